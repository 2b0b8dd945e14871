# Completion of shakerctl for bash.
_shakerctl() {
  local word=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} options
  local commands="status watch run stop estop ack estimate compare response diagnose drop reproduce export check monte-carlo plan"
  case $previous in
    --periods) mapfile -t COMPREPLY < <(compgen -W "2 3" -- "$word"); return ;;
    --bias)  # of `reproduce` it is a flag
      if [[ ${COMP_WORDS[1]} != reproduce ]]; then
        mapfile -t COMPREPLY < <(compgen -W "auto off always" -- "$word")
        return
      fi ;;
    --figure) mapfile -t COMPREPLY < <(compgen -W "5 6 7 9 10 11 12 13 14" -- "$word"); return ;;
    --frequency | --amplitude | --seconds | --start | --starts | --seed | --accuracy | --method | --from | --to | --at | --amplitudes) return ;;
    --directory | --out) mapfile -t COMPREPLY < <(compgen -d -- "$word"); return ;;
    --socket | --model | --rig | --svg | --draw) mapfile -t COMPREPLY < <(compgen -f -- "$word"); return ;;
  esac
  if ((COMP_CWORD == 1)); then
    mapfile -t COMPREPLY < <(compgen -W "$commands --help --version" -- "$word")
    return
  fi
  case ${COMP_WORDS[1]} in
    status | stop | estop | ack | run) options="--json --socket --help" ;;
    watch) options="--json --socket --seconds --help" ;;
    estimate) options="--json --model --frequency --amplitude --periods --starts --seed --accuracy --intervals --loss --bias --objective --channels --noise --mass --stagewise --transient --initial --integrator --help" ;;
    compare) options="--json --model --frequency --amplitude --figure --start --method --help" ;;
    diagnose) options="--json --model --out --false-alarm-rate --thorough --daemon --socket --help" ;;
    drop) options="--json --sink-speed --campaign --model --estimate --lift --mass --duration --samples --identified-speed --identified-stroke --truth --svg --help" ;;
    response) options="--json --amplitude --from --to --at --amplitudes --svg --help" ;;
    reproduce) options="--json --figure --bias --help" ;;
    export) options="--json --directory --samples --all --help" ;;
    monte-carlo)
      options="--json --figure --frequency --amplitude --noise --uniform --points --cycles
        --replications --seed --threads --profile --bias --help" ;;
    plan)
      options="--json --rig --frequencies --amplitudes --runs --noise --points --cycles --threads
        --draw --help" ;;
    check) options="--json --rig --help" ;;
  esac
  if [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$word")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
}
complete -o filenames -F _shakerctl shakerctl
