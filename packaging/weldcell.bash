# bash completion of weldcell: commands and options are asked of the program itself, so they are those of the version that is installed.
_weldcell() {
  local word=${COMP_WORDS[COMP_CWORD]} words=
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    words=$(weldcell --help 2>/dev/null | sed -nE 's/^  ([a-z][a-z-]*) .*/\1/p')
  elif [[ $word == -* ]]; then
    words=$(weldcell "${COMP_WORDS[1]}" --help 2>/dev/null | grep -oE -- '--[a-z][a-z-]*' | sort -u)
  else
    case ${COMP_WORDS[1]} in
      operate) words="arm start confirm stop hold unhold resume clear reset abort" ;;
      calibrate) words="latency" ;;
      show|hold|release|cancel) words=$(weldcell jobs --json 2>/dev/null | grep -oE '"job": *"[^"]+"' | sed -E 's/.*"([^"]+)"$/\1/') ;;
    esac
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
}
complete -o default -F _weldcell weldcell
