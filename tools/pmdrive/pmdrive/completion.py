"""Tab completion for bash: after a command, its options and choices, and the names of objects where it takes them."""
from . import dictionary, names

TAKE_NAMES = ("info", "list", "get", "set", "dump", "monitor", "trace")
SCRIPT = """\
_pmdrive() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} command= n
    for ((n = 1; n < COMP_CWORD; n++)); do
        case ${{COMP_WORDS[n]}} in
            {commands}) command=${{COMP_WORDS[n]}}; break ;;
        esac
    done
    local words
    case $command in
        '') words='{top}' ;;
{cases}
    esac
    if [[ $command == set ]]; then
        compopt -o nospace
        words="${{words// /= }}="
    fi
    COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _pmdrive pmdrive
"""


def _words(parser):
    """Options and choices of a parser."""
    found = []
    for action in parser._actions:
        found += [option for option in action.option_strings if option.startswith("--")]
        found += [str(choice) for choice in action.choices or ()]
    return found


def commands():
    """{name: parser}"""
    from . import cli

    return next(action.choices for action in cli.parser()._actions if hasattr(action.choices, "items"))


def script():
    from . import cli

    found = commands()
    objects = " ".join(sorted({*(e.name for e in dictionary.ENTRIES), *names.RECORDS}))
    cases = [f"        {name}) words='{' '.join(_words(sub))}{' ' + objects if name in TAKE_NAMES else ''}' ;;"
             for name, sub in found.items()]
    return SCRIPT.format(commands="|".join(found), top=" ".join(_words(cli.parser())), cases="\n".join(cases))
