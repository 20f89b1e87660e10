"""All files made from the dictionary, as {path: text}."""
from pathlib import Path

import jinja2

from . import emit_c, ledger, reader

ROOT = Path(__file__).resolve().parents[2]
SOURCE = "firmware/params/parameters.yaml"
FAULTS = "firmware/drive/fault.def"
LEDGER = "firmware/params/allocations.txt"


def _environment():
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(str(Path(__file__).parent / "templates")),
        undefined=jinja2.StrictUndefined, keep_trailing_newline=True, autoescape=False,
    )
    environment.filters.update(emit_c.FILTERS)
    return environment


def files(root=ROOT):
    """Reads and checks the source below root and makes everything from it."""
    root = Path(root)
    dictionary = reader.read(root / SOURCE, root / FAULTS, SOURCE)
    out = {LEDGER: ledger.update(root / LEDGER, dictionary)}
    environment = _environment()

    def render(path, template, **names):
        out[path] = environment.get_template(template).render(**names)

    render("firmware/drive/parameters.def", "parameters.def.j2", objects=dictionary.objects)
    render("firmware/app/error_codes.def", "error_codes.def.j2", faults=dictionary.faults)
    render("firmware/can/dictionary_slots.h", "dictionary_slots.h.j2", node=dictionary.of("node"),
           live=dictionary.of("live"), parameters=dictionary.of("parameter"),
           bytes=[e for e in dictionary.of("constant") if e.bits == 0])
    render("firmware/can/dictionary_table.c", "dictionary_table.c.j2", entries=dictionary.entries,
           schema=emit_c.schema(dictionary))
    render("firmware/can/dictionary_bytes.c", "dictionary_bytes.c.j2", constants=emit_c.constants(dictionary, b"?"))
    return out


def same(path, data, root=ROOT):
    target = Path(root) / path
    return target.is_file() and target.read_bytes() == data.encode("utf-8")


def write(path, data, root=ROOT):
    target = Path(root) / path
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_bytes(data.encode("utf-8"))
