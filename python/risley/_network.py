# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Sensors on the network: record them, and emulate one."""
import logging
from typing import Any, Dict, List, Mapping, Optional, Sequence

from risley import _risley
from risley._progress import Progress, reporting
from risley._risley import Stop
from risley._units import AnySensor, Path, options_of, suggesting

_logger = logging.getLogger("risley")


def _note(words: str, is_wrong: bool) -> None:
    _logger.log(logging.WARNING if is_wrong else logging.INFO, "%s", words)


@suggesting
def find_sensors(interface: str = "", *, find: float = 2.5,
                 progress: Progress = None) -> List[Dict[str, Any]]:
    """Find the Livox sensors on an interface. A search is sent to all, and nothing else.

    Parameters
    ----------
    interface : str, optional
        IPv4 address of this machine on which the sensors are; by default its only one.
    find : float, default 2.5
        How long to listen, s. A sensor announces itself once a second.
    progress : bool or callable, optional
        As in `risley.read`.

    Returns
    -------
    list of dict
        The ``sensors`` of ``risley record --list --json``.

    Raises
    ------
    NetworkError, ValueError
        If the port of the broadcasts is taken, and for an address that is not of this machine.
    """
    with reporting(progress) as on_progress:
        found = _risley.find_sensors(options_of({"interface": interface, "find": find}), on_progress)
    return list(found["sensors"])


@suggesting
def record(output: Path, *, duration: Optional[float] = None, stop: Optional[Stop] = None,
           interface: str = "", serial: Sequence[str] = (), find: float = 2.5,
           passive: bool = False, data_port: int = 56001, coordinates: str = "spherical",
           return_mode: str = "as-is", imu: bool = True, optics: AnySensor = "",
           publish: Optional[str] = None, calibration: AnySensor = "", topic: str = "/risley/points",
           frame_id: str = "livox_frame", frame_rate: float = 20.0,
           progress: Progress = None) -> Dict[str, Any]:
    """Record Livox sensors of both generations from the network.

    Events, such as a sensor that falls silent, go to the logger ``risley``.

    Parameters
    ----------
    output : str or path
        The recording, LVX or NetCDF by its ending; until the end it is an LVX file called
        ``OUTPUT.unfinished``. Sensors of the second generation are written to the ``.lvx2`` of
        this name, others to the ``.lvx``.
    duration : float, optional
        Length, s, from the first data on; by default until `stop` is set.
    stop : Stop, optional
        Ends the recording when another thread sets it. After Ctrl-C the recording is whole, too,
        but KeyboardInterrupt is raised.
    interface : str, optional
        IPv4 address of this machine on which the sensors are; by default its only one.
    serial : sequence of str
        Serial numbers (broadcast codes) of the sensors to record; by default all.
    find : float, default 2.5
        How long sensors are looked for, s.
    passive : bool, default False
        Only listen to what sensors send to this address anyway.
    data_port : int, default 56001
        Port of the data to which `passive` listens.
    coordinates : {'spherical', 'cartesian', 'as-is'}
        What the sensors are to send; those of the second generation send Cartesian coordinates
        unless 'as-is'.
    return_mode : {'as-is', 'first', 'strongest', 'dual', 'triple'}
        Returns of a shot that they are to send.
    imu : bool, default True
        Record inertial samples where the sensor has them.
    optics : str, path, Sensor or result, optional
        Watch the optics: 'own' reports when they change during the recording, a preset or
        calibration also when they differ from it. An alarm is a warning of the logger and
        stands in the result.
    publish : str, optional
        Send points with covariance while they are recorded: ``"foxglove:PORT"`` or
        ``"foxglove:ADDRESS:PORT"`` to Foxglove-compatible viewers, ``"dds"`` or ``"dds:DOMAIN"`` to
        nodes of ROS 2. The logger says where they are.
    calibration : str, path, Sensor or result, optional
        Of these points; by default the preset of the sensor, with directions as it reports them.
    topic, frame_id : str
        Topic and frame of these points.
    frame_rate : float, default 20.0
        Messages of these points per second, Hz, 10 to 50.
    progress : bool or callable, optional
        As in `risley.read`.

    Returns
    -------
    dict
        As ``risley record --json``.

    Raises
    ------
    NetworkError
        If there is no sensor, none sends anything, or a socket is refused.
    FileError, ValueError
        If the file cannot be written, and for invalid options.
    """
    options = options_of(locals())
    with reporting(progress) as on_progress:
        return dict(_risley.record(options, _note, stop, on_progress))


@suggesting
def emulate(interface: str, *, duration: Optional[float] = None, stop: Optional[Stop] = None,
            serial: str = "", sensor: AnySensor = "mid-40", scene: Path = "", station: str = "",
            recording: Path = "", speed: float = 1.0, noise_angle: Optional[float] = None,
            noise_angle_deg: Optional[float] = None, noise_range: Optional[float] = None,
            quantize: bool = True, beam_origin: bool = True, rotor: str = "constant",
            set: Mapping[str, float] = {}, reported: Mapping[str, float] = {},
            reported_nominal: bool = False, start_angles: Optional[Sequence[float]] = None,
            start_angles_deg: Optional[Sequence[float]] = None, time: str = "power-on",
            time_from: float = 0.0, clock_drift: float = 0.0,
            clock_jump: Optional[float] = None, clock_jump_by: float = 0.25, loss: float = 0.0,
            duplication: float = 0.0, disorder: float = 0.0, disorder_packets: int = 10,
            delay: float = 0.0, wrong_checksums: float = 0.0,
            heartbeat_dies: Optional[float] = None, restart: Optional[float] = None,
            restart_takes: float = 2.0, bend: Mapping[str, float] = {},
            bend_s: Optional[float] = None, seed: int = 0, threads: int = 0,
            progress: Progress = None) -> Dict[str, Any]:
    """Be a Livox sensor on the network, with known truth.

    Parameters
    ----------
    interface : str
        IPv4 address of this machine that is to be the sensor's, such as 127.0.0.5.
    duration : float, optional
        How long the sensor is there, s of real time; by default until `stop` is set.
    stop : Stop, optional
        Ends it when another thread sets it.
    serial : str, optional
        Serial number (broadcast code); by default from the optics.
    scene : str or path, optional
        Planes or terrain (YAML) around it; by default a room.
    recording : str or path, optional
        Recording of one sensor whose shots are sent instead, with its gaps, over and over.
    speed : float, default 1
        How many times faster than real time it runs.
    sensor, station, noise_angle, noise_angle_deg, noise_range, quantize, beam_origin, rotor
        As in `risley.simulate`.
    set, reported, reported_nominal, start_angles, start_angles_deg, seed
        As in `risley.simulate`.
    time : {'power-on', 'ptp', 'pps'}
        What its times count from.
    time_from : float, default 0
        When that begins, s after the first start; before, they count from power-on.
    clock_drift : float, default 0
        By how much its clock is faster than this machine's, s/s.
    clock_jump, clock_jump_by : float
        When its clock jumps, s after the first start; by default never. How far it jumps, s.
    loss, duplication, disorder, wrong_checksums : float
        Shares of packets that are not sent, sent twice, or overtaken by others, and of replies and
        broadcasts that are damaged, from 0 to 1.
    disorder_packets : int, default 10
        How many packets overtake one at most.
    delay : float, default 0
        By how much data come late, s.
    heartbeat_dies, restart : float, optional
        When heartbeats are no longer answered, and when the sensor restarts, s after the start.
    restart_takes : float, default 2
        How long a restart takes, s.
    bend : mapping of str to float
        What is added to parameters of the true sensor while it runs, in the unit of the name.
    bend_s : float, optional
        When the optics bend so, s after the start.
    threads, progress
        As in `risley.estimate`.

    Returns
    -------
    dict
        As ``risley emulate --json``: the truth of what was sent.

    Raises
    ------
    NetworkError
        If the address or a port cannot be used.
    FileError, ValueError
        For files that cannot be read, and for invalid options.
    """
    options = options_of(locals())
    with reporting(progress) as on_progress:
        return dict(_risley.emulate(options, threads, _note, stop, on_progress))
