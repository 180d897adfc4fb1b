# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# Completion of the risley command for bash. The test cli.completion_test fails when an option of
# the command is missing here.
_risley() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}
  local verbs="info convert simulate estimate observability calibrate cloud compare identify pattern preset report reproduce"
  local common="--help --json --threads --seed --quiet --verbose"
  local names="refractive_index_air refractive_index refractive_index_a refractive_index_b
    wedge_angle_deg wedge_angle_a_deg wedge_angle_b_deg
    incident_beam_horizontal_deg incident_beam_vertical_deg
    bearing_tilt_a_horizontal_deg bearing_tilt_a_vertical_deg
    prism_tilt_a_horizontal_deg prism_tilt_a_vertical_deg
    prism_tilt_b_horizontal_deg prism_tilt_b_vertical_deg"
  local presets="avia avia-sequence horizon horizon-sequence mid-40 mid-40-reversed mid-40-sequence
    mid-40-table3 mid-70 tele-15 tele-15-sequence"
  local speeds="angular_velocity_a_deg_per_s angular_velocity_b_deg_per_s"
  local verb="" word
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    case " $verbs " in *" $word "*) verb=$word; break ;; esac
  done

  local choices=""
  case $previous in
    --quantize | --beam-origin | --beam-divergence | --covariance | --common-factors)
      choices="yes no" ;;
    --directions) choices="smoothed reported" ;;
    --time) choices="gps recording" ;;
    --sensor-type) choices="avia horizon mid-40 mid-70 tele-15" ;;
    --trajectory-format) choices="csv sbet" ;;
    --rotor) choices="constant sinusoidal hunting random-walk" ;;
    --method) case $verb in calibrate) choices="adjustment paper" ;; *) choices="map ekf" ;; esac ;;
    --states) choices="knots all none" ;;
    --mirror) choices="auto yes no" ;;
    --process-noise) choices="auto paper" ;;
    --rate-hz) case $verb in estimate | observability | calibrate | cloud) choices="full" ;; esac ;;
    --fix | --free) choices=$names ;;
    --set) choices="$names $speeds" ;;
    --reported) choices="nominal $names" ;;
    --sensor | --calibration | --from) choices=$presets ;;
    --firing) choices="in-turn together" ;;
    --format)
      case $verb in
        cloud) choices="las-1.4 las-1.2 ply pcd npy csv xyz netcdf ros1-bag" ;;
        pattern) choices="livox-csv npy helios-xml json usda" ;;
        *) choices="lvx-1.1 netcdf openpylivox-bin openpylivox-csv scan-sequence-csv trajectory-csv sbet" ;;
      esac ;;
  esac
  if [ -n "$choices" ]; then
    mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$current")
    case $previous in --set) compopt -o nospace ;; esac
    [[ $previous == --sensor || $previous == --calibration || $previous == --from ]] && mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY \
      < <(compgen -f -- "$current")
    return
  fi
  if [[ $current == -* ]]; then
    case $verb in
      "") choices="--help --version" ;;
      info) choices="$common --shot-rate-hz --extrinsics --share --share-ranges --accuracy --trajectory-topic" ;;
      identify) choices="$common --output --force --most-prisms --fastest-hz --shot-rate-hz --extrinsics" ;;
      pattern)
        choices="$common --output --format --sensor --duration-s --rate-hz --every --firing
          --start-angles-deg --coverage --integration-s --cell-deg --report" ;;
      preset)
        choices=$common
        case " ${COMP_WORDS[*]} " in
          *" show "*) choices="$common --output" ;;
          *" new "*) choices="$common --output --from" ;;
        esac ;;
      report) choices="$common --output" ;;
      compare) choices="$common --output --false-alarm" ;;
      convert) choices="$common --output --format --sensor-type --accuracy --trajectory-topic --shot-rate-hz --extrinsics" ;;
      simulate)
        choices="$common --output --sensor --duration-s --rate-hz --noise-angle-deg
          --noise-range-m --quantize --beam-origin --rotor --set --reported --scene --station
          --trajectory --trajectory-topic --flight --mount --trajectory-errors --trajectory-format --start-s
          --clock-drift-ppm --start-angles-deg" ;;
      estimate)
        choices="$common --output --method --rate-hz --noise-angle-deg --sensor --fix --free
          --states --mirror --process-noise --truth --shot-rate-hz --extrinsics" ;;
      observability)
        choices="$common --sensor --duration-s --rate-hz --noise-angle-deg --no-rounding
          --fix --free --shot-rate-hz --extrinsics" ;;
      calibrate)
        choices="$common --output --method --planes --stations --station --plan --duration-s
          --rate-hz --noise-angle-deg --noise-range-m --sensor --fix --free --prior-sigma-deg
          --range-offset-sigma-m --beam-origin --states --mirror --force --truth --trajectory
          --trajectory-topic --mount --accuracy --trajectory-errors --control --knot-spacing-s --cell-size-m --scene
          --empty-circle-m --report --shot-rate-hz
          --extrinsics" ;;
      cloud)
        choices="$common --output --calibration --format --directions --beam-origin --covariance
          --beam-divergence --common-factors --trajectory --trajectory-topic --mount --accuracy --trajectory-errors --crs
          --datum --distribution --report --rate-hz --noise-angle-deg --las-scale-m --time --beam-origin-map --shot-rate-hz --extrinsics" ;;
      reproduce) choices="$common --output --full --recording --shot-rate-hz --extrinsics" ;;
    esac
    mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$current")
    return
  fi
  if [ -z "$verb" ]; then
    mapfile -t COMPREPLY < <(compgen -W "$verbs" -- "$current")
  elif [ "$verb $previous" = "preset preset" ]; then
    mapfile -t COMPREPLY < <(compgen -W "list show check new" -- "$current")
  elif [ "$verb $previous" = "preset show" ]; then
    mapfile -t COMPREPLY < <(compgen -W "$presets" -- "$current")
  else
    compopt -o default
    COMPREPLY=()
  fi
}
complete -F _risley risley
