# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Jobs on recordings and files, one for each verb of the command."""
import os
from typing import Any, Dict, Iterable, Mapping, Optional, Sequence, Tuple, Union, overload

from risley import _risley
from risley._progress import Progress, reporting
from risley._results import (Answer, Calibration, Cloud, CloudOfStations, Estimate,
                             FlightCalibration, Identification, Pattern, Plan, Scan, Simulation, needed)
from risley._units import (AnyMount, AnySensor, AnyTrajectory, Fixed, Path, Rate, Source, Truth,
                           YawPitchRoll, listed, options_of, suggesting)


@suggesting
def estimate(recording: Source, *, sensor: AnySensor = "", output: Path = "", method: str = "map",
             rate: Rate = None, noise_angle: Optional[float] = None,
             noise_angle_deg: Optional[float] = None, fix: Fixed = (), free: Iterable[str] = (),
             mirror: Optional[bool] = None, process_noise: Union[float, str] = "auto",
             process_noise_deg: Optional[float] = None, truth: Truth = "", states: str = "knots",
             noise_model: bool = False, shot_rate: Optional[float] = None, extrinsics: YawPitchRoll = None,
             extrinsics_deg: YawPitchRoll = None, device: str = "", threads: int = 0,
             progress: Progress = None) -> Estimate:
    """Estimate a sensor's parameters and rotation angles from a recording.

    Parameters
    ----------
    recording : str, path, Recording or Simulation
        A recording of one sensor: a file, or in memory.
    sensor : str, path, Sensor or result, optional
        Name of a preset, a preset or calibration file or its folder, or what a job found; otherwise
        found from the recording.
    output : str or path, optional
        Folder for calibration.yaml, states.nc, report.json and report.html.
    method : {'map', 'ekf'}
        All shots at once, or the paper's filter.
    rate : float or 'full', optional
        Shots per second to use, Hz; by default what is usual for the method.
    noise_angle, noise_angle_deg : float, optional
        Standard deviation of the noise of azimuth and zenith before rounding, rad or deg; by
        default estimated.
    fix : mapping of str to float or None, or iterable of str
        Parameters to hold, at the given value (in the unit of the name) if there is one.
    free : iterable of str
        Further parameters to estimate.
    mirror : bool, optional
        Whether the elevation has the opposite sign; by default found from the recording.
    process_noise, process_noise_deg : float or {'auto', 'paper', 'none'}
        Random walk of the rotors' speeds, rad/s or deg/s per root of a second; that of the paper;
        none, which is constant acceleration; by default found by maximum likelihood.
    truth : str, path or Simulation, optional
        ``OUT.truth.yaml`` of the simulation that made the recording, to compare the estimate with.
    states : {'knots', 'all', 'none'}
        Rotor states to write into ``output``.
    noise_model : bool, default False
        Find the sigmas that programs of lidar odometry ask for, and what part of them all points
        share.
    shot_rate, extrinsics, extrinsics_deg, device
        As in `risley.read`.
    threads : int, default 0
        Number of threads; 0 means one per core.
    progress : bool or callable, optional
        As in `risley.read`.

    Returns
    -------
    Estimate

    Raises
    ------
    EstimationError
        If nothing can be estimated from the data.
    FileError, ValueError
        For damaged files, and for invalid options.
    """
    options = options_of(locals())
    with reporting(progress) as on_progress:
        return Estimate(_risley.estimate(options, threads, on_progress))


@suggesting
def calibrate(recordings: Union[Source, Sequence[Source]], *, sensor: AnySensor = "",
              output: Path = "", method: str = "adjustment", planes: Path = "", stations: Path = "",
              station: Sequence[str] = (), trajectory: AnyTrajectory = "",
              trajectory_topic: str = "", mount: AnyMount = "", accuracy: Path = "",
              trajectory_errors: Path = "", control: Path = "",
              knot_spacing: Optional[float] = None,
              cell_size: Optional[float] = None, rate: Rate = None,
              noise_angle: Optional[float] = None, noise_angle_deg: Optional[float] = None,
              noise_range: Optional[float] = None, prior_sigma: Optional[float] = None,
              prior_sigma_deg: Optional[float] = None, range_offset_sigma: Optional[float] = None,
              tolerance: Optional[float] = None, tolerance_deg: Optional[float] = None,
              beam_origin: bool = True, same_walls: Optional[bool] = None,
              walls: str = "uneven", patch_thickness: Optional[float] = None,
              fix: Fixed = (), free: Iterable[str] = (), mirror: Optional[bool] = None,
              truth: Union[Truth, Sequence[Truth]] = (), force: bool = False,
              states: str = "knots", shot_rate: Optional[float] = None,
              extrinsics: YawPitchRoll = None, extrinsics_deg: YawPitchRoll = None,
              device: str = "", seed: int = 0, threads: int = 0,
              progress: Progress = None) -> Union[Calibration, FlightCalibration]:
    """Calibrate a sensor on plane walls or, with a trajectory, on the strips of a flight.

    Parameters
    ----------
    recordings : str, path, Recording or a sequence of them
        Recordings of one sensor, with ranges: files, or in memory.
    sensor : str, path, Sensor or result, optional
        As in `risley.estimate`.
    output : str or path, optional
        Folder for calibration.yaml, states, report.json and report.html; for a flight also for
        mount.yaml and trajectory.csv.
    method : {'adjustment', 'paper'}
        On walls: a weighted adjustment of all recordings, or unweighted distances as in the paper.
    planes : str or path, optional
        Names of walls (YAML); those with a ``sigma_deg`` have known normals.
    stations : str or path, optional
        Known rotations of the sensor (YAML): one station per recording, in the same order.
    station : sequence of str
        Names of the stations in that file to use, in the order of the recordings.
    trajectory : str, path, Trajectory, FlightCalibration or Simulation
        For a flight: the platform's trajectory.
    mount : str, path, Mount or FlightCalibration
        For a flight: the mounting of the sensor on the platform.
    trajectory_topic : str
        Topic to use if the trajectory is a ROS bag with several topics of poses.
    accuracy, trajectory_errors : str or path, optional
        How wrong the trajectory may be: accuracies (SMRMSG), or an error process (YAML).
    control : str or path, optional
        Known points and planes of the ground (YAML).
    knot_spacing, cell_size : float, optional
        Time between corrections of the trajectory, s; edge of the squares of ground, m.
    rate : float or 'full', optional
        Shots per second to use, Hz; by default all.
    noise_angle, noise_angle_deg : float, optional
        Standard deviation of the noise of azimuth and zenith before rounding, rad or deg; by
        default the sensor's.
    noise_range : float, optional
        Standard deviation of ranges before rounding, m; by default the sensor's.
    prior_sigma, prior_sigma_deg : float, optional
        Prior standard deviation of every error angle around the believed value, rad or deg; by
        default there is no such prior.
    range_offset_sigma : float, optional
        Prior standard deviation of the range offset, m; 0 holds it.
    tolerance, tolerance_deg : float, optional
        Root mean square error of directions up to which a unit counts as sound, rad or deg; by
        default the manufacturer's specification, as in the preset.
    beam_origin : bool, default True
        Whether beams start where they leave the last prism.
    same_walls : bool, optional
        Whether the recordings are of the same walls from poses that differ by a turn, so that the
        walls' shape cancels; by default where their planes fit in one way only.
    walls : {'uneven', 'flat'}
        'flat' takes walls as exact planes, and ranges as free of errors but for a constant one.
    patch_thickness : float, optional
        How far dark or light patches stand off their wall, one standard deviation, m; 0 for paint.
    fix, free, mirror, shot_rate, extrinsics, extrinsics_deg, device, threads, progress
        As in `risley.estimate`.
    truth : str, path or a sequence of them
        ``OUT.truth.yaml`` of the simulation that made each recording, to compare with.
    force : bool, default False
        Write calibration.yaml even if it does not improve on the sensor's own directions.
    states : {'knots', 'all', 'none'}
        Rotor states to write into ``output``.
    seed : int, default 0
        Seed of the search for planes.

    Returns
    -------
    Calibration or FlightCalibration

    Raises
    ------
    EstimationError
        If there is nothing to calibrate on.
    FileError, ValueError
        For damaged files, and for invalid options.
    """
    options = options_of({**locals(), "truth": listed("truth", truth)})
    with reporting(progress) as on_progress:
        if trajectory != "":
            _refuse({"planes": planes, "stations": stations, "station": station},
                    "is not for a calibration with trajectory")
            return FlightCalibration(_risley.calibrate_flight(options, threads, on_progress))
        _refuse({"mount": mount, "accuracy": accuracy, "control": control,
                 "trajectory_errors": trajectory_errors, "knot_spacing": knot_spacing,
                 "cell_size": cell_size}, "is not for a calibration with no trajectory")
        return Calibration(_risley.calibrate(options, threads, on_progress))


def _refuse(options: Mapping[str, Any], why: str) -> None:
    for name, value in options.items():
        if value not in (None, "", (), []):
            raise ValueError(f"{name} {why}")


@suggesting
def plan(scene_or_flight: Path, *, sensor: AnySensor = "", duration: Optional[float] = None,
         mount: AnyMount = "", trajectory_errors: Path = "", scene: Path = "",
         knot_spacing: Optional[float] = None, cell_size: Optional[float] = None,
         empty_circle: Optional[float] = None, rate: Optional[float] = None,
         noise_range: Optional[float] = None, prior_sigma: Optional[float] = None,
         prior_sigma_deg: Optional[float] = None, range_offset_sigma: Optional[float] = None,
         beam_origin: bool = True, walls: str = "uneven", fix: Fixed = (),
         free: Iterable[str] = (), seed: int = 0,
         progress: Progress = None) -> Plan:
    """Predict the accuracy of a calibration on planned walls or in a planned flight.

    Parameters
    ----------
    scene_or_flight : str or path
        A scene of walls with stations, or a flight with strips (YAML).
    sensor : str, path, Sensor or result, optional
        As in `risley.estimate`; by default a Mid-40.
    duration : float, optional
        Length of each recording of walls, s; by default 10.
    mount, trajectory_errors : str or path
        For a flight: the mounting of the sensor on the platform, and the errors of the trajectory.
    scene : str or path, optional
        For a flight: the terrain; by default level ground.
    knot_spacing, cell_size, empty_circle : float, optional
        For a flight: time between corrections of the trajectory, s; edge of the squares of ground,
        m; diameter of the circles that are searched for points, m.
    rate : float, optional
        Shots per second, Hz; by default the sensor's, for a flight 5000.
    noise_range, prior_sigma, prior_sigma_deg, range_offset_sigma, beam_origin, walls, fix,
    free, seed
        As in `risley.calibrate`.
    progress : bool or callable, optional
        As in `risley.read`.

    Returns
    -------
    Plan

    Raises
    ------
    EstimationError, FileError, ValueError
        As in `risley.calibrate`.
    """
    options = options_of({**locals(), "plan": scene_or_flight})
    with reporting(progress) as on_progress:
        if _risley.is_flight_plan(os.fspath(scene_or_flight)):
            if duration is not None:
                raise ValueError("duration is not for a planned flight, whose strips say it")
            return Plan(_risley.plan_flight(options, on_progress))
        _refuse({"mount": mount, "trajectory_errors": trajectory_errors, "scene": scene,
                 "knot_spacing": knot_spacing, "cell_size": cell_size,
                 "empty_circle": empty_circle},
                f"goes with a flight, and {scene_or_flight} is a scene")
        return Plan(_risley.plan(options, on_progress))


@suggesting
def cloud(recording: Union[Source, Sequence[Source]], calibration: AnySensor, output: Path, *,
          format: str = "", station: Path = "", replace: bool = False,
          directions: str = "smoothed", beam_origin: bool = True, beam_divergence: bool = True,
          covariance: bool = True, common_factors: bool = False, rate: Rate = None,
          noise_angle: Optional[float] = None, noise_angle_deg: Optional[float] = None,
          las_scale: Optional[float] = None, time: str = "gps", trajectory: AnyTrajectory = "",
          trajectory_topic: str = "", mount: AnyMount = "", accuracy: Path = "",
          trajectory_errors: Path = "", crs: str = "", datum: str = "", distribution: bool = False,
          topic: str = "", frame_id: str = "livox_frame", frame_rate: float = 10.0,
          message: Optional[str] = None,
          shot_rate: Optional[float] = None, extrinsics: YawPitchRoll = None,
          extrinsics_deg: YawPitchRoll = None, device: str = "", threads: int = 0,
          progress: Progress = None) -> Union[Cloud, CloudOfStations]:
    """Turn a recording into points with covariance, or those on the stations of a tripod.

    Parameters
    ----------
    recording : str, path, Recording or, with `station`, a sequence of them
        A recording of one sensor, with ranges: a file, or in memory.
    calibration : str, path, Sensor or result
        ``calibration.yaml`` of an estimate or a calibration, the folder that holds it (of one in
        flight with its mount and trajectory), the name of a preset, or what a job found; empty: the
        preset of the sensor, with directions as reported.
    output : str or path
        The file; its ending chooses the format unless `format` does.
    format : str, optional
        Name of a format; the ending then does not matter.
    station : str or path, optional
        Stations of a tripod (YAML), one per recording and in the same order: poses on the map, or
        targets that determine them. All points go into one file.
    replace : bool, default False
        Write the recording's bag again, with the points of the lidar by the calibration and all
        else as it is.
    directions : {'smoothed', 'reported'}
        Directions from the calibration, or as the sensor reports them.
    beam_origin, beam_divergence, covariance : bool, default True
        Start beams where they leave the last prism; include the footprint in the covariance; write
        covariances.
    common_factors : bool, default False
        Write for every point the loadings of the errors that all points share.
    rate : float or 'full', optional
        Directions per second from which rotation angles are found, Hz.
    noise_angle, noise_angle_deg : float, optional
        Standard deviation of the noise of azimuth and zenith before rounding, rad or deg; by
        default the calibration's.
    las_scale : float, optional
        LAS stores coordinates as multiples of this, m.
    time : {'gps', 'recording'}
        For LAS: GPS time if the recording's clock is UTC, or the clock as it is.
    trajectory, trajectory_topic, mount, accuracy, trajectory_errors
        As in `risley.calibrate`, for a moving sensor.
    crs, datum : str, optional
        Map of the points and datum of the trajectory, ``EPSG:N``.
    distribution : bool, default False
        Report how the points of a flight lie on the ground.
    topic, frame_id : str, optional
        Topic and frame of the points in bags.
    frame_rate : float, default 10.0
        Messages of points in bags per second, Hz.
    message : {'points', 'custom', 'custom2'}, optional
        Messages of points in bags: PointCloud2 with the fields of ``livox_ros_driver2``, CustomMsg
        of the driver of the sensor's generation, or of ``livox_ros_driver2``; by default 'points'.
    shot_rate, extrinsics, extrinsics_deg, device, threads, progress
        As in `risley.estimate`.

    Returns
    -------
    Cloud or CloudOfStations

    Raises
    ------
    EstimationError
        If the motion of the rotors cannot be found.
    FileError, ValueError
        For damaged files, and for invalid options.
    """
    if station == "":
        options = options_of(locals())
        with reporting(progress) as on_progress:
            return Cloud(_risley.cloud(options, threads, on_progress))
    _refuse({"trajectory": trajectory, "mount": mount, "accuracy": accuracy, "replace": replace or None,
             "trajectory_errors": trajectory_errors, "distribution": distribution or None},
            "is not for a sensor on stations")
    given = {**locals(), "recordings": recording}
    del given["recording"]
    options = options_of(given)
    with reporting(progress) as on_progress:
        return CloudOfStations(_risley.cloud_of_stations(options, threads, on_progress))


@suggesting
def simulate(output: Path, *, sensor: AnySensor = "mid-40", duration: Optional[float] = None,
             rate: Optional[float] = None, noise_angle: Optional[float] = None,
             noise_angle_deg: Optional[float] = None, noise_range: Optional[float] = None,
             quantize: bool = True, beam_origin: bool = True, rotor: str = "constant",
             set: Mapping[str, float] = {}, reported: Mapping[str, float] = {},
             reported_nominal: bool = False, start_angles: Optional[Sequence[float]] = None,
             start_angles_deg: Optional[Sequence[float]] = None, scene: Path = "",
             station: str = "", trajectory: AnyTrajectory = "", trajectory_topic: str = "",
             flight: Path = "", mount: AnyMount = "", trajectory_errors: Path = "",
             trajectory_format: str = "csv", start: Optional[float] = None,
             clock_drift: Optional[float] = None, topic: str = "",
             frame_id: str = "livox_frame", frame_rate: float = 10.0,
             message: Optional[str] = None, seed: int = 0, threads: int = 0,
             progress: Progress = None) -> Simulation:
    """Write a recording with known truth.

    Parameters
    ----------
    output : str or path
        The recording; its ending chooses the format. The truth is written beside it.
    sensor : str, path, Sensor or result, default 'mid-40'
        The true sensor, as in `risley.estimate`.
    duration : float, optional
        Length, s; by default 1, or until the end of the trajectory.
    rate : float, optional
        Shots per second, Hz; by default the sensor's.
    noise_angle, noise_angle_deg, noise_range : float, optional
        Standard deviations of directions, rad or deg, and of ranges, m; by default the sensor's.
    quantize : bool, default True
        Round to the sensor's resolution.
    beam_origin : bool, default True
        Start beams where they leave the last prism.
    rotor : {'constant', 'sinusoidal', 'hunting'}
        How the rotors run.
    set : mapping of str to float
        Parameters of the true sensor, in the unit of the name, and its range errors:
        "range_offset_m", "range_near_m", "range_incidence", "range_per_decade_m",
        "range_emitter_1_m", ...
    reported : mapping of str to float
        Parameters whose value in the sensor's firmware differs from the true one.
    reported_nominal : bool, default False
        The sensor's firmware assumes that it has no errors.
    start_angles, start_angles_deg : sequence of float, optional
        Rotation angles at the start, rad or deg; by default random, from the seed.
    scene : str or path, optional
        Planes or terrain (YAML); without it there are no ranges.
    station : str, optional
        Station of the scene at which the sensor stands.
    trajectory, flight : str or path, optional
        Trajectory along which the sensor moves, or a flight plan.
    trajectory_topic : str, optional
        Topic to use if the trajectory is a ROS bag with several topics of poses.
    mount, trajectory_errors : str or path
        True mount of the moving sensor; errors of the trajectory that a user would have.
    trajectory_format : str, default 'csv'
        Format of that trajectory.
    start : float, optional
        Start of the recording after the first record of the trajectory, s.
    clock_drift : float, optional
        Rate at which the trajectory's time gains on the sensor's clock, s/s.
    topic, frame_id, frame_rate, message
        As in `risley.cloud`, with 'custom' as the usual `message`.
    seed : int, default 0
        The same seed gives the same bytes.
    threads : int, default 0
        Number of threads; 0 means one per core.
    progress : bool or callable, optional
        As in `risley.read`.

    Returns
    -------
    Simulation

    Raises
    ------
    FileError, ValueError
        For files that cannot be read or written, and for invalid options.
    """
    options = options_of(locals())
    with reporting(progress) as on_progress:
        return Simulation(_risley.simulate(options, threads, on_progress))


@suggesting
def identify(recording: Source, *, output: Path = "", force: bool = False, most_prisms: int = 3,
             fastest: Optional[float] = None, shot_rate: Optional[float] = None,
             extrinsics: YawPitchRoll = None, extrinsics_deg: YawPitchRoll = None, device: str = "",
             threads: int = 0, progress: Progress = None) -> Identification:
    """Find which prisms made a scan, from its times and directions alone.

    Parameters
    ----------
    recording : str, path or Recording
        A recording of one sensor: a file, or in memory.
    output : str or path, optional
        Preset to write (.yaml), which can be given as ``sensor`` elsewhere.
    force : bool, default False
        Write it even if the answer is undecided.
    most_prisms : int, default 3
        Largest number of prisms to try.
    fastest : float, optional
        Largest speed of a rotor, rad/s; by default 400 turns a second.
    shot_rate, extrinsics, extrinsics_deg, device, threads, progress
        As in `risley.estimate`.

    Returns
    -------
    Identification

    Raises
    ------
    EstimationError
        If nothing can be estimated from the data.
    FileError, ValueError
        For damaged files, and for invalid options.
    """
    options = options_of(locals())
    with reporting(progress) as on_progress:
        return Identification(*_risley.identify(options, threads, on_progress))


@overload
def pattern(sensor: AnySensor, *, start: float = 0.0, duration: float = 1.0,
            dtype: Any = "float64", rate: Optional[float] = None, every: int = 1,
            firing: Optional[str] = None, start_angles: Optional[Sequence[float]] = None,
            start_angles_deg: Optional[Sequence[float]] = None, threads: int = 0,
            progress: Progress = None) -> Scan: ...
@overload
def pattern(sensor: AnySensor, format: str, output: Path, *, duration: float = 1.0,
            rate: Optional[float] = None, every: int = 1, firing: Optional[str] = None,
            start_angles: Optional[Sequence[float]] = None,
            start_angles_deg: Optional[Sequence[float]] = None, threads: int = 0,
            progress: Progress = None) -> Pattern: ...
@suggesting
def pattern(sensor: AnySensor, format: str = "", output: Path = "", *, start: float = 0.0,
            duration: float = 1.0, dtype: Any = "float64", rate: Optional[float] = None,
            every: int = 1, firing: Optional[str] = None,
            start_angles: Optional[Sequence[float]] = None,
            start_angles_deg: Optional[Sequence[float]] = None, threads: int = 0,
            progress: Progress = None) -> Union[Scan, Pattern]:
    """Compute where a sensor sends its shots, or write that for simulators.

    Parameters
    ----------
    sensor : str, path, Sensor or result
        As in `risley.estimate`.
    format : str, optional
        ``livox-csv``, ``helios-xml``, ``npy`` and others, as ``risley pattern --help`` lists them.
    output : str or path, optional
        The file; without one the directions are returned.
    start : float, default 0
        Where the scan that is returned begins, s after the rotors' start.
    duration : float, default 1
        Length of the scan, s.
    dtype : {'float64', 'float32'} or what numpy takes for them
        Precision of the directions that are returned. Single precision is right to 2e-6 rad, and
        several times as fast.
    rate : float, optional
        Shots per second, Hz; by default the sensor's.
    every : int, default 1
        Keep one of so many shots.
    firing : {'in-turn', 'together'}, optional
        When the emitters fire if there are several; by default as in the preset.
    start_angles, start_angles_deg : sequence of float, optional
        Rotation angles at time 0, rad or deg; by default the preset's.
    threads : int, default 0
        Number of threads; 0 means one per core.
    progress : bool or callable, optional
        As in `risley.read`.

    Returns
    -------
    Scan or Pattern
        Arrays, or what was written.

    Raises
    ------
    FileError, ValueError
        For files that cannot be written, and for invalid options.
    """
    if not isinstance(dtype, str) or dtype not in ("float64", "float32"):
        dtype = needed("numpy", f"dtype = {dtype!r}").dtype(dtype).name
    options = options_of(locals())
    with reporting(progress) as on_progress:
        if not output:
            if format:
                raise ValueError(f"format = {format!r} goes with output")
            return Scan(options, _risley.pattern_directions(options, threads, on_progress))
        if start or dtype != "float64":
            raise ValueError("start and dtype are for a scan that is returned, without output")
        return Pattern(_risley.pattern(options, threads, on_progress))


@suggesting
def coverage(sensor: AnySensor, *, after: Optional[Sequence[float]] = None,
             cell: Optional[float] = None, cell_deg: Optional[float] = None,
             rate: Optional[float] = None, every: int = 1, firing: Optional[str] = None,
             start_angles: Optional[Sequence[float]] = None,
             start_angles_deg: Optional[Sequence[float]] = None, threads: int = 0,
             progress: Progress = None) -> Answer:
    """Compute how the scan of a sensor fills its field of view.

    Parameters
    ----------
    sensor : str, path, Sensor or result
        As in `risley.estimate`.
    after : sequence of float, optional
        Times since the start of the scan, s.
    cell, cell_deg : float, optional
        Edge of a cell, rad or deg.
    rate, every, firing, start_angles, start_angles_deg, threads, progress
        As in `risley.pattern`.

    Returns
    -------
    Answer
        A dictionary as ``coverage`` in ``risley pattern --coverage --json``.
    """
    options = options_of(locals())
    with reporting(progress) as on_progress:
        return Answer("coverage", _risley.coverage(options, threads, on_progress))


@suggesting
def observability(recording: Source = "", *, sensor: AnySensor = "",
                  duration: Optional[float] = None, rate: Rate = None,
                  noise_angle: Optional[float] = None,
                  noise_angle_deg: Optional[float] = None, rounding: bool = True,
                  fix: Fixed = (), free: Iterable[str] = (), shot_rate: Optional[float] = None,
                  extrinsics: YawPitchRoll = None, extrinsics_deg: YawPitchRoll = None,
                  device: str = "", threads: int = 0, progress: Progress = None) -> Answer:
    """Compute Cramér-Rao bounds of all parameters for a recording or a plan.

    Parameters
    ----------
    recording : str, path or Recording, optional
        The recording, a file or in memory; without one, the bounds are those of a plan.
    duration : float, optional
        Length of the plan, s; by default 30.
    rate : float or 'full', optional
        Shots per second of the plan, or to use from the recording, Hz.
    rounding : bool, default True
        Whether the angles of a plan are rounded to the sensor's resolution.
    sensor, noise_angle, noise_angle_deg, fix, free, shot_rate, extrinsics, extrinsics_deg, device
        As in `risley.estimate`.
    threads, progress
        As in `risley.estimate`.

    Returns
    -------
    Answer
        A dictionary as in ``risley observability --json``.
    """
    options = options_of(locals())
    with reporting(progress) as on_progress:
        return Answer("observability", _risley.observability(options, threads, on_progress))


@suggesting
def compare(results: Sequence[AnySensor], *, false_alarm: float = 0.01, anywhere: bool = False,
            unlike: bool = False, cell_size: Optional[float] = None,
            reach: Optional[float] = None, progress: Progress = None) -> Answer:
    """Find out whether a unit has changed, which units of a fleet are unlike the others, or what
    has changed between two clouds.

    Parameters
    ----------
    results : sequence of str, path, Sensor or result
        What `estimate` or `calibrate` found, their folders, or calibration files, in order of
        time; also tables of such results, whose rows are followed. At least two results. Or two
        clouds (LAS) of `cloud`, the earlier one first.
    false_alarm : float, default 0.01
        Probability that chance is taken for a change, or a unit for an outlier, at most; of clouds
        the share of unchanged cells that are called changed.
    anywhere : bool, default False
        Open results that a table names outside of its own folder, too.
    unlike : bool, default False
        Also compare a calibration (true beam directions) with an estimate (the sensor's own
        directions).
    cell_size, reach : float, optional
        Of clouds: edge of the cells that get a distance each, and how far surfaces may have moved,
        m; by default 0.5.
    progress : bool or callable, optional
        As in `risley.read`.

    Returns
    -------
    Answer
        A dictionary as ``risley compare --json``.

    Raises
    ------
    FileError, ValueError
        For damaged files and tables without any result, and for results of which no two are of one
        kind of sensor.
    """
    options = options_of(locals())
    with reporting(progress) as on_progress:
        return Answer("compare", _risley.compare(options, on_progress))


@suggesting
def campaign(plan: Path, output: Path, *, chunk: Optional[Tuple[int, int]] = None,
             merge: bool = False, table: Path = "", seed: int = 0, threads: int = 0,
             progress: Progress = None) -> Answer:
    """Simulate and estimate or calibrate repeatedly, according to a plan.

    Parameters
    ----------
    plan : str or path
        Plan (YAML): what to simulate, what to do with it, a grid of settings, and how many seeds.
    output : str or path
        Folder for the results: ``chunks/`` and ``cells.csv``.
    chunk : (int, int), optional
        Number of the chunk to compute, from 1, and of how many. One that is there and whole is
        not computed again. By default all chunks are computed and merged.
    merge : bool, default False
        Make the table of the chunks that are there.
    table : str or path, optional
        Table to write with one row per cell, by default ``cells.csv`` in the folder. The ending
        chooses the format.
    seed : int, default 0
        Added to the seeds of the plan, for other draws.
    threads, progress
        As in `risley.estimate`.

    Returns
    -------
    Answer
        A dictionary as ``risley campaign --json``. ``missing`` holds the cells without a result.

    Raises
    ------
    FileError, ValueError
        For an invalid plan or one that cannot be simulated; with `merge` also if there is no
        chunk.
    """
    if chunk is not None and merge:
        raise ValueError("chunk and merge cannot be combined: merge when all chunks are done")
    options: Dict[str, Any] = {
        "plan": os.fspath(plan), "output": os.fspath(output), "merge": merge,
        "seed": seed, "table": os.fspath(table) or os.path.join(os.fspath(output), "cells.csv")}
    if chunk is not None:
        options["chunk"], options["chunks"] = chunk
    with reporting(progress) as on_progress:
        return Answer("campaign", _risley.campaign(options, threads, on_progress))


@suggesting
def info(file: Source, *, accuracy: Path = "", trajectory_topic: str = "",
         shot_rate: Optional[float] = None, extrinsics: YawPitchRoll = None,
         extrinsics_deg: YawPitchRoll = None, device: str = "",
         progress: Progress = None) -> Answer:
    """Describe what a recording or a trajectory holds, and check its times.

    Parameters
    ----------
    file : str, path or Recording
        A recording or trajectory in any known format, or a recording in memory.
    accuracy : str or path, optional
        Accuracies of a trajectory (SMRMSG).
    trajectory_topic : str, optional
        Topic of a ROS bag whose poses are described.
    shot_rate, extrinsics, extrinsics_deg, device, progress
        As in `risley.read`.

    Returns
    -------
    Answer
        A dictionary as in ``risley info --json``. Damage is reported under ``error``.
    """
    options = options_of({**locals(), "recording": file})
    with reporting(progress) as on_progress:
        return Answer("info", _risley.info(options, on_progress))
