"""YAML with places: every value knows its file and line, so that a refusal can name them.

Scalars are read as what the reader asks for, not as YAML guesses: `access: off` is a word, not a boolean.
"""
import yaml


LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # the same rules, ten times as fast, where it is there


class SourceError(Exception):
    """Something in the source is wrong; the text begins with file:line."""


class Place:
    def __init__(self, file, node):
        self.file, self.line = file, node.start_mark.line + 1

    def __str__(self):
        return f"{self.file}:{self.line}"

    def error(self, text):
        return SourceError(f"{self}: {text}")


def as_text(place, node):
    if not isinstance(node, yaml.ScalarNode):
        raise place.error("a single value is needed here, not a list or a table")
    return node.value


def as_integer(place, node):
    text = as_text(place, node)
    try:
        return int(text.replace("_", ""), 0)
    except ValueError:
        raise place.error(f"`{text}` is not an integer") from None


class Table:
    """A mapping of the source: values are fetched by key and in a wanted form."""

    def __init__(self, file, node, what):
        self.place, self.what = Place(file, node), what
        if not isinstance(node, yaml.MappingNode):
            raise self.place.error(f"{what} must be a table of keys and values")
        self.nodes = {}
        for key, value in node.value:
            name = as_text(Place(file, key), key)
            if name in self.nodes:
                raise Place(file, key).error(f"key `{name}` stands twice in {what}")
            self.nodes[name] = value

    def at(self, key):
        return Place(self.place.file, self.nodes[key]) if key in self.nodes else self.place

    def error(self, text, key=None):
        return self.at(key).error(f"{self.what}: {text}")

    def only(self, allowed):
        for key in self.nodes:
            if key not in allowed:
                raise self.error(f"unknown key `{key}`; known are: {', '.join(sorted(allowed))}", key)

    def node(self, key):
        if key not in self.nodes:
            raise self.error(f"key `{key}` is missing")
        return self.nodes[key]

    def text(self, key, default=None):
        if key not in self.nodes and default is not None:
            return default
        return as_text(self.at(key), self.node(key))

    def integer(self, key, default=None):
        if key not in self.nodes and default is not None:
            return default
        return as_integer(self.at(key), self.node(key))

    def flag(self, key, default=False):
        if key not in self.nodes:
            return default
        text = self.text(key)
        if text not in ("true", "false"):
            raise self.error(f"`{key}` is true or false, not `{text}`", key)
        return text == "true"

    def choice(self, key, choices, default=None):
        if key not in self.nodes:
            if default is None:
                raise self.error(f"key `{key}` is missing")
            return default
        text = self.text(key)
        if text not in choices:
            raise self.error(f"`{key}` is one of {', '.join(choices)}; not `{text}`", key)
        return text

    def items(self, key):
        node = self.node(key)
        if not isinstance(node, yaml.SequenceNode):
            raise self.error(f"`{key}` must be a list", key)
        return node.value

    def integers(self, key):
        return [as_integer(Place(self.place.file, x), x) for x in self.items(key)]

    def texts(self, key):
        return [as_text(Place(self.place.file, x), x) for x in self.items(key)]

    def table(self, key):
        return Table(self.place.file, self.node(key), f"`{key}` of {self.what}")

    def tables(self, key, what):
        return [Table(self.place.file, x, what) for x in self.items(key)]


def load(path, shown=None):
    """The table that a file is."""
    name = str(shown or path)
    try:
        with open(path, encoding="utf-8") as file:
            root = yaml.compose(file, Loader=LOADER)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        raise SourceError(f"{name}{line}: {getattr(error, 'problem', None) or error}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise SourceError(f"{name}: {error}") from None
    if root is None:
        raise SourceError(f"{name}: the file is empty")
    return Table(name, root, "the file")
