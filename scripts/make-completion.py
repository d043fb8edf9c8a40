#!/usr/bin/env python3
"""Writes completion scripts for bash and zsh from the help texts of sqslam.

usage: scripts/make-completion.py PROGRAM FOLDER     e.g. build/release/bin/sqslam build/release/package/sqslam

The help texts list commands, options and the values of options in a uniform format, which this script parses.
"""
import pathlib
import re
import subprocess
import sys

OPTION = re.compile(r"^  (?:(-\w), )?(--[\w-]+)(?: ([A-Z][^\s]*))?")
COMMAND = re.compile(r"^  ([a-z][a-z-]*)  +\S")
WORDS = re.compile(r"\(([a-z0-9][\w.+-]*(?:, [\w.+-]+)+)(?:[;)]|; )")


def help_of(program, *command):
    text = subprocess.run([program, *command, "--help"], capture_output=True, text=True, check=True,
                          env={"COLUMNS": "200", "PATH": "/usr/bin"}).stdout
    return text.split("\nExamples:")[0]


def commands_in(text):
    return [m.group(1) for m in map(COMMAND.match, text.split("\nGeneral:")[0].splitlines()) if m]


def options_in(text):
    """Options with the words they allow: None for a flag, an empty list for free values."""
    options = {}
    for paragraph in re.split(r"\n(?=  -|\n)", text):
        match = OPTION.match(paragraph.lstrip("\n"))
        if match:
            words = WORDS.search(" ".join(paragraph.split()))
            values = None if not match.group(3) else (words.group(1).split(", ") if words else [])
            if values and "FILE" in paragraph:
                values.append("")  # and files
            for name in filter(None, match.group(1, 2)):
                options[name] = values
    return options


def table(program):
    """{command words: options}, and the commands below each."""
    top = help_of(program)
    commands = {(): commands_in(top)}
    options = {(): options_in(top)}
    for name in commands[()]:
        text = help_of(program, name)
        options[(name,)] = options_in(text)
        if name == "figure":
            commands[(name,)] = commands_in(text)
            for figure in commands[(name,)]:
                options[(name, figure)] = options_in(help_of(program, name, figure))
    return commands, options


def bash_script(commands, options):
    def case(words, listed, indent):
        return f'{indent}"{" ".join(words)}") words="{" ".join(listed)}" ;;'

    lines = ["# Completion of bash for sqslam; made by scripts/make-completion.py.", "_sqslam() {",
             '  local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command="" words=""',
             '  if [ "$COMP_CWORD" -gt 1 ]; then command=${COMP_WORDS[1]}; fi',
             '  if [ "$command" = figure ] && [ "$COMP_CWORD" -gt 2 ]; then command="figure ${COMP_WORDS[2]}"; fi',
             '  case "$command $before" in']
    for words, known in options.items():
        for option, values in known.items():
            if values is not None:
                pattern = f'"{" ".join(words)} {option}"'
                files = "" if values and values[-1] else "-f "
                reply = f'COMPREPLY=($(compgen {files}-W "{" ".join(filter(None, values))}" -- "$current"))'
                lines.append(f"    {pattern}) {reply}; return ;;")
    lines += ["  esac", '  case "$command" in']
    for words, known in options.items():
        lines.append(case(words, [*commands.get(words, []), *known], "    "))
    lines += ["  esac", '  COMPREPLY=($(compgen -W "$words" -- "$current"))',
              '  if [ -n "$command" ] && [[ "$current" != -* ]]; then COMPREPLY+=($(compgen -f -- "$current")); fi',
              "}", "complete -o filenames -F _sqslam sqslam", ""]
    return "\n".join(lines)


def zsh_script(bash):
    return "#compdef sqslam\nautoload -U +X bashcompinit && bashcompinit\n" + bash


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[2])
    bash = bash_script(*table(sys.argv[1]))
    for path, text in (("bash-completion/completions/sqslam", bash),
                       ("zsh/vendor-completions/_sqslam", zsh_script(bash))):
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)


if __name__ == "__main__":
    main()
