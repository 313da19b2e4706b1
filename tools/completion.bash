# SPDX-License-Identifier: LGPL-2.1-or-later
# Completes the command lines of codedexposure in bash: commands, options, then
# files. What there is, its --help says.
_codedexposure ()
{
  local word=${COMP_WORDS[COMP_CWORD]} i help commands choices=
  local -a row=()
  # Only of commands that a help lists: bench runs other words.
  for ((i = 1; ; i++)); do
    help=$("${COMP_WORDS[0]}" "${row[@]}" --help 2> /dev/null < /dev/null) || return 0
    commands=$(sed -nE 's/^  ([a-z]+)  +[a-z].*/\1/p' <<< "$help")
    ((i < COMP_CWORD)) && grep -qxF -e "${COMP_WORDS[i]}" <<< "$commands" || break
    row+=("${COMP_WORDS[i]}")
  done
  if [[ $word == -* ]]; then
    choices=$(grep -oE -- '^  -[-a-z]+(, --[a-z-]+)?' <<< "$help" | tr -d ,)
  elif ((i == COMP_CWORD)); then
    choices=$commands
  fi
  mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$word")
}
complete -o bashdefault -o default -F _codedexposure codedexposure
