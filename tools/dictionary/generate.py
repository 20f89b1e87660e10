"""All files made from the dictionary, as {path: text}."""
import re
from pathlib import Path

import jinja2

from . import emit_c, emit_dbc, emit_docs, emit_eds, ledger, methods, model, reader

ROOT = Path(__file__).resolve().parents[2]
SOURCE = "firmware/params/parameters.yaml"
FAULTS = "firmware/drive/fault.def"
PACKAGE = "tools/pmdrive/pmdrive"
BYTES = "firmware/can/dictionary_bytes.c"
LEDGER = "firmware/params/allocations.txt"
# Lists whose methods are all beside them: METHODS_H of the folder has their headers.
LISTS = "observers/observers.def", "injection/injections.def", "firmware/control/regulators.def"
METHODS_H = "methods.h"
# Beside a method x.h stands x.yaml with its parameters.
METHODS = "observers/*.yaml", "injection/**/*.yaml", "bldc/**/*.yaml", "firmware/control/*.yaml", "firmware/drive/**/*.yaml", \
    "firmware/can/*.yaml"


def _environment():
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(str(Path(__file__).parent / "templates")),
        undefined=jinja2.StrictUndefined, keep_trailing_newline=True, autoescape=False,
    )
    environment.filters.update(emit_c.FILTERS)
    environment.filters.update(emit_eds.FILTERS_OF_TEMPLATE)
    environment.filters.update(emit_docs.FILTERS)
    return environment


def _c_files(render, dictionary, sheet):
    known = methods.known(ROOT)
    of_image = emit_c.image_methods(dictionary, known)
    _headers(render, known)
    groups = [(obj.name, emit_c.runs([e for e in obj.entries if e.lives == "parameter"], of_image)) for obj in dictionary.objects
             if obj.entries[-1].lives == "parameter" and not obj.entries[-1].alias]
    render("firmware/params/parameters.def", "parameters.def.j2", parts=groups)
    render("tools/pmsim/parameter_values.def", "parameter_values.def.j2",
           entries=[e for e in dictionary.of("parameter") if e.values and not e.alias])
    render("firmware/app/error_codes.def", "error_codes.def.j2", faults=dictionary.faults)
    node = dictionary.of("node")
    render("firmware/can/dictionary_slots.h", "dictionary_slots.h.j2", words=[e for e in node if not model.is_mapping(e)],
           mappings=[e for e in node if model.is_mapping(e)], live=dictionary.of("live"),
           parameters=emit_c.runs(dictionary.of("parameter"), of_image),
           bytes=[e for e in dictionary.of("constant") if e.bits == 0])
    render("firmware/can/dictionary_table.c", "dictionary_table.c.j2", runs=emit_c.runs(dictionary.entries, of_image),
           values=emit_c.all_values(dictionary), schema=emit_c.schema(dictionary))
    render(BYTES, "dictionary_bytes.c.j2",
           constants=emit_c.constants(dictionary, sheet, of_image))


def _headers(render, known):
    for path in LISTS:
        folder = path.rpartition("/")[0]
        render(f"{folder}/{METHODS_H}", "methods.h.j2", list=path, folder=folder, guard="_".join(folder.removeprefix("firmware/").upper().split("/")) + "_METHODS_H",
               methods=sorted(name for name, found in known.items() if found == path))


def stored_eds(text):
    """The electronic data sheet that the text of BYTES holds, empty if there is none."""
    match = re.search(r"stored_eds\[\] = \{([^}]*)\}", text)
    return bytes(int(x, 16) for x in re.findall(r"0x([0-9A-F]{2})", match[1])) if match else b""


def parts(root=ROOT):
    """The files of methods below root."""
    return sorted(path.relative_to(root).as_posix() for pattern in METHODS for path in Path(root).glob(pattern))


def read(root=ROOT):
    return reader.read(Path(root), SOURCE, FAULTS, parts(root))


def files(root=ROOT):
    """Reads and checks the source below root and makes everything from it: {path: text}."""
    root = Path(root)
    dictionary = read(root)
    out = {LEDGER: ledger.update(root / LEDGER, dictionary)}
    environment = _environment()

    def render(path, template, **names):
        out[path] = environment.get_template(template).render(**names)

    counts = {way: sum(p.direction == way for p in dictionary.pdos) for way in ("receive", "transmit")}
    names = {"device": dictionary.device, "objects": dictionary.objects, "faults": dictionary.faults,
             "errors": dictionary.errors, "pdos": dictionary.pdos, "schema": emit_c.schema(dictionary), **counts}
    render("docs/object-dictionary.md", "object-dictionary.md.j2", parts=emit_docs.parts(dictionary), **names)
    render(f"{PACKAGE}/dictionary.py", "dictionary.py.j2",
           rows=[(obj.name, e) for obj in dictionary.objects for e in obj.entries], **names)
    render(f"{PACKAGE}/pmdrive.dbc", "dbc.j2", messages=emit_dbc.messages(dictionary),
           node_id=dictionary.device["default_node_id"])
    lists = emit_eds.lists(dictionary)
    render(f"{PACKAGE}/pmdrive.eds", "eds.j2", stored=False, lists=lists, **names)
    short = environment.get_template("eds.j2").render(stored=True, lists=lists, **names)
    before = (root / BYTES).read_text(encoding="ascii") if (root / BYTES).is_file() else ""
    _c_files(render, dictionary, emit_eds.compressed(short, stored_eds(before)))
    return out


def same(path, data, root=ROOT):
    target = Path(root) / path
    return target.is_file() and target.read_bytes() == data.encode("utf-8")


def write(path, data, root=ROOT):
    target = Path(root) / path
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(data.encode("utf-8"))
