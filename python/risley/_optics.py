# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The observation model and its inverse, for arrays."""
from typing import Any, NamedTuple, Optional, Sequence, Tuple, Union

from risley import _risley
from risley._units import suggesting

Optics = Union[_risley.PrismTrain, _risley.Sensor]


class Directions(NamedTuple):
    """Directions of shots.

    Attributes
    ----------
    azimuth : float or ndarray
        From X towards Y, rad.
    zenith : float or ndarray
        From Z, rad.
    """

    azimuth: Any
    zenith: Any


class Rays(NamedTuple):
    """Beams as lines in space: x, y and z of each in the sensor's frame.

    Attributes
    ----------
    origin : tuple
        Where the beam leaves the last face, m.
    direction : tuple
        Unit vectors.
    """

    origin: Tuple[Any, Any, Any]
    direction: Tuple[Any, Any, Any]


class Linearisation(NamedTuple):
    """Directions and their derivatives.

    The first axis of the derivatives runs over the flat parameters of the train
    (`PrismTrain.parameters`) and then over the rotation angles of the prisms.

    Attributes
    ----------
    azimuth, zenith : float or ndarray
        As in `Directions`, rad.
    d_azimuth, d_zenith : ndarray
        Their derivatives, rad per SI unit.
    """

    azimuth: Any
    zenith: Any
    d_azimuth: Any
    d_zenith: Any


class Inverse(NamedTuple):
    """Pairs of rotation angles of the last two prisms, rad; filled up to four with NaN.

    Attributes
    ----------
    first : ndarray
        Of the second-to-last prism, shape (..., 4).
    second : ndarray
        Of the last prism, shape (..., 4).
    count : int or ndarray
        Number of pairs found, shape (...).
    continuum : bool or ndarray
        Whether infinitely many pairs reach the direction, shape (...).
    """

    first: Any
    second: Any
    count: Any
    continuum: Any


def _train(optics: Optics) -> _risley.PrismTrain:
    return optics.train if isinstance(optics, _risley.Sensor) else optics


@suggesting
def observe(optics: Optics, angles: Any, *, beam: Any = None,
            out: Optional[Tuple[Any, Any]] = None) -> Directions:
    """Directions of shots.

    Parameters
    ----------
    optics : PrismTrain or Sensor
        The optics that bend the beams.
    angles : array_like of float, shape (prisms, ...), or one array_like per prism
        Rotation angles in the order of the beam, rad. They broadcast. Arrays of float64 in C order
        are read without a copy.
    beam : array_like of int, optional
        Number of the emitter of every shot, from 0; broadcasts with the angles.
    out : (ndarray, ndarray), optional
        Arrays to write azimuth and zenith to, float64 in C order.

    Returns
    -------
    Directions
        Azimuth in (-pi, pi] and zenith in [0, pi], rad; NaN for beams that do not get through the
        prisms, and for angles that are NaN.

    Raises
    ------
    ValueError
        If the shape of an array does not match the others, or a beam does not exist; the message
        names it.

    Notes
    -----
    This is the practical model of Brazeal, Wilkinson and Hochmair (2021), `observe_batch()` of the
    C++ libraries.
    """
    azimuth_out, zenith_out = (None, None) if out is None else out
    return Directions(*_risley.observe(_train(optics), angles, beam, azimuth_out, zenith_out))


@suggesting
def rays(optics: Optics, angles: Any, *, beam: Any = None,
         prism_thickness: Optional[Sequence[float]] = None,
         prism_spacing: Optional[Sequence[float]] = None) -> Rays:
    """Beams of shots as lines in space.

    Parameters
    ----------
    optics, angles, beam
        As in `observe`.
    prism_thickness, prism_spacing : sequence of float, optional
        Sizes of the prisms, m: one value each, or one for all. By default those of the sensor;
        beams of a train without sizes start at the origin of the frame.

    Returns
    -------
    Rays

    Raises
    ------
    ValueError
        As in `observe`, and for the wrong number of sizes.
    """
    if isinstance(optics, _risley.Sensor):
        if prism_thickness is None:
            prism_thickness = optics.prism_thickness
        if prism_spacing is None:
            prism_spacing = optics.prism_spacing
    return Rays(*_risley.rays(_train(optics), angles, beam, list(prism_thickness or []),
                              list(prism_spacing or [])))


@suggesting
def linearise(optics: Optics, angles: Any, *, beam: Any = None) -> Linearisation:
    """Directions of shots and their derivatives by parameters and rotation angles.

    Parameters
    ----------
    optics, angles, beam
        As in `observe`.

    Returns
    -------
    Linearisation

    Raises
    ------
    ValueError
        As in `observe`.
    """
    return Linearisation(*_risley.linearise(_train(optics), angles, beam))


@suggesting
def invert(optics: Optics, azimuth: Any, zenith: Any, *, beam: Any = 0,
           fixed_angles: Sequence[float] = ()) -> Inverse:
    """Rotation angles of the last two prisms that send beams in given directions.

    Parameters
    ----------
    optics : PrismTrain or Sensor
        The optics that bend the beams.
    azimuth, zenith : array_like of float
        Directions, rad. They broadcast.
    beam : array_like of int, default 0
        Number of the emitter, from 0.
    fixed_angles : sequence of float, optional
        Rotation angles of all prisms before the last two, rad.

    Returns
    -------
    Inverse
        Sorted by the second angle. No pairs are found outside the field of view and for NaN.

    Raises
    ------
    ValueError
        For arrays whose shapes do not match, fewer than two prisms, or the wrong number of fixed
        angles.
    """
    return Inverse(*_risley.invert(_train(optics), azimuth, zenith, list(fixed_angles), beam))
