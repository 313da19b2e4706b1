# SPDX-License-Identifier: LGPL-2.1-or-later
# Completes the command lines of codedexposure in bash: commands, options, then
# files. What there is, its --help says.
_codedexposure ()
{
  local word=${COMP_WORDS[COMP_CWORD]} i help
  local -a before=()
  for ((i = 1; i < COMP_CWORD; i++)); do
    [[ ${COMP_WORDS[i]} == -* ]] && break
    before+=("${COMP_WORDS[i]}")
  done
  # The longest row of commands; what follows are names of files.
  while ! help=$("${COMP_WORDS[0]}" "${before[@]}" --help 2> /dev/null < /dev/null); do
    ((${#before[@]})) || return 0
    unset 'before[-1]'
  done
  local choices
  if [[ $word == -* ]]; then
    choices=$(grep -oE -- '^  -[-a-z]+(, --[a-z-]+)?' <<< "$help" | tr -d ,)
  elif [[ ${COMP_WORDS[COMP_CWORD - 1]} != -* ]]; then
    choices=$(sed -nE 's/^  ([a-z]+)  +[a-z].*/\1/p' <<< "$help")
  fi
  mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$word")
}
complete -o bashdefault -o default -F _codedexposure codedexposure
