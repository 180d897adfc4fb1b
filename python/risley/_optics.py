# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The observation model and its inverse over arrays."""
from typing import Any, NamedTuple, Optional, Sequence, Tuple, Union

from risley import _risley

Optics = Union[_risley.PrismTrain, _risley.Sensor]


class Directions(NamedTuple):
    """Where shots point, rad: azimuth from X towards Y, zenith from Z."""

    azimuth: Any
    zenith: Any


class Rays(NamedTuple):
    """Beams as lines in space, x, y and z of each in the sensor's frame."""

    origin: Tuple[Any, Any, Any]  #: where the beam leaves the last face, m
    direction: Tuple[Any, Any, Any]  #: unit vectors


class Linearisation(NamedTuple):
    """Directions and their derivatives, rad per SI unit.

    The first axis of the derivatives stands for the flat parameters of the train
    (`PrismTrain.parameters`), then for the rotation angles of the prisms.
    """

    azimuth: Any
    zenith: Any
    d_azimuth: Any
    d_zenith: Any


class Inverse(NamedTuple):
    """Pairs of rotation angles of the last two prisms, rad; NaN where there are fewer than four."""

    first: Any  #: of the last prism but one, shape (..., 4)
    second: Any  #: of the last prism, shape (..., 4)
    count: Any  #: pairs found, shape (...)
    continuum: Any  #: whether infinitely many pairs reach the direction


def _train(optics: Optics) -> _risley.PrismTrain:
    return optics.train if isinstance(optics, _risley.Sensor) else optics


def observe(optics: Optics, angles: Any, *, beam: Any = None,
            out: Optional[Tuple[Any, Any]] = None) -> Directions:
    """Directions of shots.

    Parameters
    ----------
    optics : PrismTrain or Sensor
        What bends the beams.
    angles : array_like of float, shape (prisms, ...), or one array_like per prism
        Rotation angles in beam order, rad. They broadcast. Arrays of float64 in C order are read
        where they lie.
    beam : array_like of int, optional
        Number of the emitter of every shot, from 0; broadcasts with the angles.
    out : (ndarray, ndarray), optional
        Where azimuth and zenith are written, float64 in C order.

    Returns
    -------
    Directions
        Azimuth in (-pi, pi] and zenith in [0, pi], rad; NaN for beams that do not get through the
        prisms and for angles that are NaN.

    Raises
    ------
    ValueError
        Naming an array whose shape does not go with the others, or a beam that there is not.

    Notes
    -----
    The practical model of Brazeal, Wilkinson and Hochmair (2021), the libraries' observe_batch().
    """
    azimuth_out, zenith_out = (None, None) if out is None else out
    return Directions(*_risley.observe(_train(optics), angles, beam, azimuth_out, zenith_out))


def rays(optics: Optics, angles: Any, *, beam: Any = None,
         prism_thickness: Optional[Sequence[float]] = None,
         prism_spacing: Optional[Sequence[float]] = None) -> Rays:
    """Beams of shots as lines in space.

    Parameters
    ----------
    optics, angles, beam
        As `observe` has them.
    prism_thickness, prism_spacing : sequence of float, optional
        Sizes of the prisms, m: one value each, or one for all. Those of a sensor where there are
        none; beams of a train without them start at the frame's origin.

    Returns
    -------
    Rays

    Raises
    ------
    ValueError
        As `observe`, and for sizes of another number of prisms.
    """
    if isinstance(optics, _risley.Sensor):
        if prism_thickness is None:
            prism_thickness = optics.prism_thickness
        if prism_spacing is None:
            prism_spacing = optics.prism_spacing
    return Rays(*_risley.rays(_train(optics), angles, beam, list(prism_thickness or []),
                              list(prism_spacing or [])))


def linearise(optics: Optics, angles: Any, *, beam: Any = None) -> Linearisation:
    """Directions of shots and how they depend on parameters and rotation angles.

    Parameters
    ----------
    optics, angles, beam
        As `observe` has them.

    Returns
    -------
    Linearisation

    Raises
    ------
    ValueError
        As `observe`.
    """
    return Linearisation(*_risley.linearise(_train(optics), angles, beam))


def invert(optics: Optics, azimuth: Any, zenith: Any, *, beam: Any = 0,
           fixed_angles: Sequence[float] = ()) -> Inverse:
    """Rotation angles of the last two prisms that point beams in directions.

    Parameters
    ----------
    optics : PrismTrain or Sensor
        What bends the beams.
    azimuth, zenith : array_like of float
        Directions, rad. They broadcast.
    beam : array_like of int, default 0
        Number of the emitter, from 0.
    fixed_angles : sequence of float, optional
        Rotation angles of all prisms before the last two, rad.

    Returns
    -------
    Inverse
        Sorted by the second angle. There are none outside the field of view and for NaN.

    Raises
    ------
    ValueError
        For arrays whose shapes do not go together, fewer than two prisms, or another number of
        fixed angles.
    """
    return Inverse(*_risley.invert(_train(optics), azimuth, zenith, list(fixed_angles), beam))
