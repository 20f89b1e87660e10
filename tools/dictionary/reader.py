"""From the source, which is parameters.yaml and the files of methods, to the dictionary of model.py."""
import re
from dataclasses import dataclass
from pathlib import Path

from . import model, pdo, source
from .methods import options
from .model import Entry, Object

NODE_ID = re.compile(r"\$NODEID *\+ *(0x[0-9A-Fa-f]+|\d+)")
EDS_FORMAT = 0x80  # 1022h: the manufacturer's own
DEVICE_KEYS = ("vendor", "vendor_id", "product", "product_code", "revision", "default_node_id")
FAULT_LINE = re.compile(r'PM_FAULT\((\w+), "([^"]*)"\)')
ROW = re.compile(r'^PM_METHOD\((\w+), "([^"]*)"', re.MULTILINE)
FACTS = ("knows", "period_instructions", "step_instructions", "interrupt", "replay", "compare",
         "take")  # read by tests and reports
PART_KEYS = ("methods", "objects", "members", "book") + FACTS  # book: read by tools/book_map.py


@dataclass
class Context:
    """What entries are read with beside their own table."""

    device: dict
    root: Path  # of the project, for lists of methods
    added: dict  # record -> [(member, methods)] of the files of methods


def _preset(table, entry, device):
    if "preset" not in table.nodes:
        return
    text = table.text("preset")
    relative = NODE_ID.fullmatch(text)
    if relative:
        entry.node_id, entry.preset = True, int(relative[1], 0)
    elif entry.type in ("string", "domain"):
        entry.text = device.get(text[1:], text) if text.startswith("$") else text
        entry.preset = 0
    elif text.startswith("$") and text[1:] in device:
        entry.preset = device[text[1:]]
    else:
        entry.preset = table.integer("preset")
    if "image_bits" in table.nodes:
        bits = table.table("image_bits")
        if len(bits.nodes) != 1:
            raise table.error("`image_bits` names one method", "image_bits")
        entry.image_bits = {name: bits.integer(name) for name in bits.nodes}
        entry.preset += sum(entry.image_bits.values())


def _name(table, pattern=model.NAME):
    name = table.text("name")
    if not pattern.fullmatch(name):
        raise table.error(f"`{name}` is not a name: letters, digits and _ only", "name")
    return name


def _entry(table, index, sub, member, record, inherit, context):
    def get(key, method, *args):
        holder = table if key in table.nodes else inherit
        return getattr(holder, method)(key, *args)

    alias = table.text("alias", "")
    lives = "parameter" if alias else get("lives", "choice", model.LIVES)
    record_name = record if record is None else _name(record)
    name = member if record is None or record.flag("flat") else f"{record_name}.{member}"
    entry = Entry(
        place=table.place, index=index, sub=sub, name=name, member=member, alias=alias, lives=lives,
        type=get("type", "choice", tuple(model.TYPES)), access=get("access", "choice", model.ACCESS),
        help=table.text("help"), unit=get("unit", "text", " ").strip(), exp10=get("exp10", "integer", 0),
        exp2=get("exp2", "integer", 0),
        stored=get("stored", "flag"), group=get("group", "choice", model.GROUPS, "none"),
        map=get("map", "choice", model.MAPS, "none"), book=table.text("book", ""),
    )
    entry.book = entry.book.strip()
    _values(table, entry)
    if "list" in table.nodes:
        _list(table, entry, context.root)
    _preset(table, entry, context.device)
    if not entry.stored:
        entry.group = "none"
    return entry


def _values(table, entry):
    if "range" in table.nodes:
        limits = table.integers("range")
        if len(limits) != 2:
            raise table.error("range is [least, most]", "range")
        entry.least, entry.most = limits
    if "values" in table.nodes:
        values = table.table("values")
        try:
            entry.values = {int(key, 0): values.text(key) for key in values.nodes}
        except ValueError:
            raise table.error("keys of values are integers", "values") from None


def _list(table, entry, root):
    """A value for each row of a list of methods, numbered on from the values that the entry has itself."""
    if "range" in table.nodes:
        raise table.error("the range follows from the list", "range")
    name = table.text("list")
    try:
        rows = ROW.findall((root / name).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise table.error(f"{name}: {error}", "list") from None
    if not rows:
        raise table.error(f"{name} has no row PM_METHOD(name, \"help\", ...)", "list")
    first = max(entry.values, default=-1) + 1
    entry.values.update(enumerate((text for _, text in rows), first))
    entry.least, entry.most = min(entry.values), max(entry.values)


def _members(table, index, methods, context):
    """Entries of a record, with sub-index 0 before them."""
    entries = []
    own = table.tables("members", f"member of {table.text('name')}")
    for member in own:
        member.only(model.MEMBER_KEYS)
    for member, of in [(x, methods) for x in own] + context.added.pop(table.text("name"), []):
        first, count = member.integer("sub"), member.integer("repeat", 1)
        if first < 1 or count < 1 or first + count > 255:
            raise member.error("sub-indices are 1 to 254", "sub")
        name = member.text("name")
        if count > 1 and "{n}" not in name:
            raise member.error("the name of repeated members must hold {n}", "name")
        for n in range(count):
            text = name.replace("{n}", str(n + 1))
            if not (model.NAME if table.flag("flat") else model.MEMBER).fullmatch(text):
                raise member.error(f"`{text}` is not a name: letters, digits and _ only", "name")
            entries.append(_entry(member, index, first + n, text, table, table, context))
            entries[-1].methods = of
    if not entries:
        raise table.error("a record has members", "members")
    entries.sort(key=lambda x: x.sub)
    return [_count_entry(table, index, entries[-1].sub, context)] + entries


def _count_entry(table, index, highest, context):
    if "sub0" not in table.nodes:
        return Entry(place=table.place, index=index, sub=0, name=f"{_name(table)}.count", member="count", type="u8",
                     lives="constant", access="const", help="highest sub-index", preset=highest)
    own = table.table("sub0")
    own.only(("access", "preset", "range", "help"))
    entry = _entry(own, index, 0, "count", table, table, context)
    entry.type, entry.unit, entry.exp10, entry.map, entry.values = "u8", "", 0, "none", {}
    return entry


def _object(table, methods, context):
    table.only(model.OBJECT_KEYS)
    index, name = table.integer("index"), _name(table)
    if not 0x1000 <= index <= 0x9FFF:
        raise table.error(f"index {index:#x} is outside 1000h to 9FFFh", "index")
    if "members" in table.nodes:
        form = table.choice("form", ("record", "array"), "record")
        entries = _members(table, index, methods, context)
    else:
        form = "variable"
        entries = [_entry(table, index, 0, name, None, table, context)]
        entries[0].methods = methods
    return Object(table.place, index, name, table.text("help"), form, entries)


def _device(root):
    table = root.table("device")
    table.only(DEVICE_KEYS)
    device = {key: table.integer(key) for key in DEVICE_KEYS if key not in ("vendor", "product")}
    if not 1 <= device["default_node_id"] <= 127:
        raise table.error("default_node_id is 1 to 127", "default_node_id")
    device["eds_format"] = EDS_FORMAT
    device["version"] = f"{device['revision'] // 0x10000}.{device['revision'] % 0x10000}"
    return {**device, "vendor": _plain(table, "vendor"), "product": _plain(table, "product")}


def _faults(root, fault_file):
    """In the order of the drive's own list, which gives the numbers."""
    with open(fault_file, encoding="utf-8") as file:
        known = FAULT_LINE.findall(file.read())
    tables = root.tables("faults", "fault")
    faults = []
    for table in tables:
        table.only(("name", "code", "register", "do"))
        name = table.text("name")
        wanted = known[len(faults)][0] if len(faults) < len(known) else "no more"
        if name != wanted:
            raise table.error(f"`{name}` stands where fault.def has `{wanted}`", "name")
        code, bit = table.integer("code"), table.integer("register")
        if not 0x1000 <= code <= 0xFFFF or not 0 <= bit <= 7:
            raise table.error("code is 1000h to FFFFh and register a bit, 0 to 7")
        faults.append(model.Fault(name, known[len(faults)][1], code, bit, _plain(table, "do")))
    if len(faults) < len(known):
        raise root.error(f"fault.def has `{known[len(faults)][0]}`, which is not here", "faults")
    return faults


def _plain(table, key):
    text = table.text(key)
    if not model.TEXT.fullmatch(text):
        raise table.error(f"only printable ASCII without quotes and backslash is possible in `{key}`", key)
    return text


def _errors(root):
    errors = {}
    for table in root.tables("errors", "error"):
        table.only(("code", "text"))
        if table.integer("code") in errors:
            raise table.error("the code stands twice", "code")
        errors[table.integer("code")] = _plain(table, "text")
    return errors


def _reserved(root):
    out = []
    for table in root.tables("reserved", "reserved range"):
        table.only(("first", "last", "why"))
        out.append((table.integer("first"), table.integer("last"), table.text("why")))
    return out


def _retired(root):
    out = []
    for table in root.tables("retired", "retired object"):
        table.only(("index", "sub", "name", "why"))
        table.text("why")
        out.append((table.integer("index"), table.integer("sub"), table.text("name")))
    return out


def _methods(root, file, project):
    """The methods of a file: what `methods` says, or the one that the file is named for."""
    names = root.texts("methods") if "methods" in root.nodes else [Path(file).stem]
    for name in names:
        if name not in options(project) and not (project / file).with_name(f"{name}.h").is_file():
            raise root.error(f"no method `{name}`: {Path(file).with_name(name + '.h')} is not there", "methods")
    return tuple(names)


def _part(file, project, added):
    """The objects of a method's file, [(table, methods)]; its members go to `added`."""
    root = source.load(project / file, file)
    root.only(PART_KEYS)
    for key in FACTS:
        root.text(key, "-")
    methods = _methods(root, file, project)
    for member in root.tables("members", "member") if "members" in root.nodes else []:
        member.only(model.MEMBER_KEYS + ("record",))
        added.setdefault(member.text("record"), []).append((member, methods))
    return [(x, methods) for x in root.tables("objects", "object")] if "objects" in root.nodes else []


def read(project, path, fault_file, parts=()):
    """The whole dictionary of the project, a folder; all files relative to it. parts: those of methods.

    SourceError with file and line if anything is wrong.
    """
    root = source.load(project / path, path)
    root.only(("device", "reserved", "retired", "objects", "pdos", "faults", "errors"))
    context = Context(_device(root), project, {})
    tables = [(table, ()) for table in root.tables("objects", "object")]
    for file in parts:
        tables += _part(file, project, context.added)
    objects = [_object(table, methods, context) for table, methods in tables]
    for name, members in context.added.items():
        raise members[0][0].error(f"no record `{name}`", "record")
    plans = pdo.read(root)
    objects += pdo.objects(plans)
    objects.sort(key=lambda x: x.index)
    dictionary = model.Dictionary(
        context.device, objects, [], _faults(root, project / fault_file), _errors(root), _reserved(root), _retired(root)
    )
    model.link_alias(dictionary)
    model.check_all(dictionary)
    model.number_slots(dictionary)
    dictionary.pdos = pdo.resolve(plans, dictionary)
    return dictionary
