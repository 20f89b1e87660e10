"""The command line without its first word, over one connection."""
import cmd
import shlex

from . import dictionary, names
from .completion import commands
from .errors import PmdriveError

OBJECTS = sorted([*(e.name for e in dictionary.ENTRIES), *names.RECORDS])


class Shell(cmd.Cmd):
    intro = "Commands as in `pmdrive --help`; tab completes; quit ends."

    def __init__(self, arguments, drive):
        super().__init__()
        self.arguments, self.drive = arguments, drive
        self.prompt = f"node {drive.node_id}> "

    def default(self, line):
        from . import cli

        if line in ("quit", "exit", "EOF"):
            return True
        try:
            words = ["--json"] if self.arguments.json else []
            arguments = cli.parse([*words, *shlex.split(line)])
            if arguments.command != "shell":
                cli.run(arguments, self.drive)
        except PmdriveError as error:
            print(error)
        except (SystemExit, ValueError, KeyboardInterrupt):
            pass
        return None

    def do_help(self, topic):
        self.default(f"help {topic}")

    def emptyline(self):
        pass

    def completenames(self, text, *_):
        return [word for word in commands() if word.startswith(text)]

    def completedefault(self, text, *_):
        return [name for name in OBJECTS if name.startswith(text)]
