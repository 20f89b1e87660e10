"""What the generator of the dictionary refuses, with file and line, and a few facts of what it makes.

Each refusal breaks the project's own source in one place, so that the rest of it stays a good source.
"""
import configparser
import lzma
import re
import shutil
import sys
import tempfile
import unittest
from pathlib import Path
from random import Random

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import gen_images  # noqa: E402
from dictionary import generate, methods, model  # noqa: E402
from dictionary.source import SourceError  # noqa: E402

GOOD = (ROOT / generate.SOURCE).read_text(encoding="utf-8")
LIST = "observers/observers.def"
PART = "observers/sliding_mode.yaml"
POLE_PAIRS = '{sub: 1, name: pole_pairs, unit: "1", exp10: 0, range: [1, 50], preset: 3, help: pole pairs}'


def pairs_of(page):
    """Words of a page in bytes but for the header, the CRC and the seals, two each."""
    header, seals = 4, 4
    return (page // 4 - header - 2) // 2 - seals


class Project:
    """A folder with the sources of the generator, and perhaps all that was made from them."""

    def __enter__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.root = Path(self.folder.name)
        folders = ("observers", "injection", "bldc", "firmware/control", "firmware/drive", "firmware/drive/procedures")
        headers = [path.relative_to(ROOT).as_posix() for folder in folders for path in sorted(ROOT.glob(f"{folder}/*.[hd]*"))]
        for path in (generate.SOURCE, generate.FAULTS, generate.LEDGER, LIST, methods.OPTIONS, *headers, *generate.parts(ROOT)):
            (self.root / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / path, self.root / path)
        return self

    def __exit__(self, *_):
        self.folder.cleanup()

    def replace(self, old, new, path=generate.SOURCE):
        file = self.root / path
        text = file.read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{old!r} stands {text.count(old)} times in {path}"
        file.write_text(text.replace(old, new), encoding="utf-8")
        return text[: text.index(old)].count("\n") + 1


class Refusals(unittest.TestCase):
    def refused(self, old, new, words, lines_on=0):
        """The changed source is refused, at the line of the change (or so many after it), in these words."""
        with Project() as project:
            line = project.replace(old, new) + lines_on
            with self.assertRaises(SourceError) as caught:
                generate.files(project.root)
            text = str(caught.exception)
            self.assertIn(words, text)
            self.assertRegex(text, rf"^firmware/params/parameters\.yaml:{line}: ")

    def member(self, old, new, words):
        self.assertIn(old, POLE_PAIRS)
        self.refused(POLE_PAIRS, POLE_PAIRS.replace(old, new), words)

    def test_not_yaml(self):
        self.refused(POLE_PAIRS, "{" + POLE_PAIRS, "expected ','", lines_on=1)

    def test_unknown_key(self):
        self.member("help:", "acces: read, help:", "unknown key `acces`")

    def test_comma_that_ends_a_text(self):
        self.member("help: pole pairs", "help: pole pairs, of the rotor", "unknown key `of the rotor`")

    def test_key_twice(self):
        self.member("preset: 3", "preset: 3, preset: 4", "key `preset` stands twice")

    def test_missing_key(self):
        self.member(", help: pole pairs", "", "key `help` is missing")

    def test_no_integer(self):
        self.member("preset: 3", "preset: three", "`three` is not an integer")

    def test_fraction(self):
        self.member("preset: 3", "preset: 3.5", "`3.5` is not an integer")

    def test_unknown_choice(self):
        self.member("help:", "access: sometimes, help:", "`access` is one of")

    def test_bad_name(self):
        self.member("name: pole_pairs", "name: pole-pairs", "`pole-pairs` is not a name")

    def test_range_upside_down(self):
        self.member("[1, 50]", "[50, 1]", "range 50 to 1 is empty")

    def test_range_of_three(self):
        self.member("[1, 50]", "[1, 2, 50]", "range is [least, most]")

    def test_range_beyond_type(self):
        self.member("[1, 50]", "[1, 2147483648]", "beyond i32")

    def test_range_without_room(self):
        self.member("[1, 50]", "[1, 2147483647]", "room beyond both ends")

    def test_preset_out_of_range(self):
        self.member("preset: 3", "preset: 51", "preset 51 is outside 1 to 50")

    def test_scaling_out_of_range(self):
        self.member("exp10: 0", "exp10: -13", "exp10 must be")

    def test_parameter_without_unit(self):
        self.member('unit: "1", exp10: 0, ', "", "with unit, range and preset")

    def test_parameter_of_another_type(self):
        self.member("sub: 1,", "sub: 1, type: u32,", "is an i32")

    def test_parameter_that_cannot_be_written(self):
        self.member("help:", "access: read, help:", "can be written")

    def test_sub_index_out_of_range(self):
        self.member("sub: 1,", "sub: 255,", "sub-indices are 1 to 254")

    def test_sub_index_zero(self):
        self.member("sub: 1,", "sub: 0,", "sub-indices are 1 to 254")

    def test_book_without_row(self):
        self.member("help:", 'book: "1.3", help:', "book is section and row")

    def test_book_row_that_is_none(self):
        self.member("help:", 'book: "1.3 #153", help:', "book is section and row")

    def test_help_of_two_lines(self):
        self.member("help: pole pairs", 'help: "pole\\npairs"', "help must be one line")

    def test_text_that_is_not_ascii(self):
        self.member("help: pole pairs", "help: pôle pairs", "only printable ASCII")
        self.member('unit: "1"', 'unit: "\\\""', "only printable ASCII")

    def test_value_out_of_range(self):
        self.member("preset: 3", "preset: 3, values: {3: three, 51: many}", "value 51 is outside")

    def test_preset_that_is_no_value(self):
        self.member("preset: 3", "preset: 3, values: {4: four}", "preset 3 is none of its values")

    def test_value_that_is_no_integer(self):
        self.member("preset: 3", "preset: 3, values: {x: four}", "keys of values are integers")

    def test_flag_that_is_none(self):
        self.member("help:", "stored: maybe, help:", "is true or false")

    def test_received_but_only_when_off(self):
        self.member("help:", "map: rx, help:", "only into what is writable at any time")

    def test_same_sub_index(self):
        self.refused("{sub: 2, name: R_s,", "{sub: 1, name: R_s,", "is used by")

    def test_same_name(self):
        self.refused("{sub: 2, name: R_s,", "{sub: 2, name: pole_pairs,", "the name is used at")

    def test_same_index(self):
        self.refused("index: 0x2200\n", "index: 0x2100\n", "index 2100h is used by machine already")

    def test_index_out_of_range(self):
        self.refused("index: 0x2200\n", "index: 0xA000\n", "is outside 1000h to 9FFFh")

    def test_reserved_index(self):
        self.refused("index: 0x2200\n", "index: 0x1F50\n", "is reserved for program download")

    def test_stored_without_preset(self):
        self.refused("stored: true, group: communication,\n   unit: s, exp10: -3, preset: 500,",
                     "stored: true, group: communication,\n   unit: s, exp10: -3,", "needs a preset")

    def test_group_without_store(self):
        self.refused("{sub: 1, name: target_current,", "{sub: 1, stored: true, name: target_current, access: read,",
                     "what is stored must be writable")

    def test_constant_without_preset(self):
        self.refused("access: const, preset: 0x0003000C", "access: const", "a constant needs a preset")

    def test_alias_of_nothing(self):
        self.refused("alias: acceleration", "alias: nothing", "no parameter `nothing`")

    def test_alias_that_does_not_fit(self):
        self.refused("alias: acceleration", "alias: L_dqh_rated", "cannot hold all values")

    def test_repeated_without_number(self):
        self.refused('repeat: 8, name: "{n}", help: scale', "repeat: 8, name: s, help: scale", "must hold {n}")

    def test_mapping_of_nothing(self):
        self.refused("map: [i_d, i_q]", "map: [i_d, i_x]", "no object `i_x` to be mapped")

    def test_mapping_in_the_wrong_direction(self):
        self.refused("map: [i_d, i_q]", "map: [i_d, controlword]", "`controlword` may not be mapped (tx)")

    def test_mapping_of_a_parameter(self):
        self.refused("map: [i_d, i_q]", "map: [R_s]", "`R_s` may not be mapped")

    def test_mapping_too_long(self):
        self.refused("map: [i_d, i_q]", "map: [i_d, i_q, quality]", "more than 8 bytes")

    def test_identifier_twice(self):
        self.refused("{cob_id: 0x280,", "{cob_id: 0x180,", "is used twice")

    def test_identifier_of_others(self):
        self.refused("{cob_id: 0x280,", "{cob_id: 0x80,", "none of the pre-defined")

    def test_fault_in_the_wrong_place(self):
        self.refused("- {name: STALL,", "- {name: STALLED,", "stands where fault.def has `STALL`")

    def test_fault_code_that_is_none(self):
        self.refused("- {name: STALL, code: 0x7121,", "- {name: STALL, code: 0x121,", "code is 1000h to FFFFh")

    def test_error_twice(self):
        self.refused("{code: 0x8120,", "{code: 0x8110,", "the code stands twice")

    def test_fault_left_out(self):
        with Project() as project:
            project.replace('PM_FAULT(TEMPERATURE_SENSOR', 'PM_FAULT(NEW, "new")\nPM_FAULT(TEMPERATURE_SENSOR',
                            generate.FAULTS)
            with self.assertRaisesRegex(SourceError, "fault.def has `NEW`"):
                generate.files(project.root)

    def test_empty_and_missing(self):
        with Project() as project:
            (project.root / generate.SOURCE).write_text("# nothing\n", encoding="utf-8")
            with self.assertRaisesRegex(SourceError, "parameters.yaml: the file is empty"):
                generate.files(project.root)
            (project.root / generate.SOURCE).unlink()
            with self.assertRaisesRegex(SourceError, "parameters.yaml: "):
                generate.files(project.root)


class Parts(unittest.TestCase):
    """Files of methods: merged into the source, and refused with their own name and line."""

    def refused(self, old, new, words, path=PART):
        with Project() as project:
            line = project.replace(old, new, path)
            with self.assertRaises(SourceError) as caught:
                generate.files(project.root)
            self.assertIn(words, str(caught.exception))
            self.assertRegex(str(caught.exception), rf"^{re.escape(path)}:{line}: ")

    def line_of(self, path, text):
        content = (ROOT / path).read_text(encoding="utf-8")
        return content[: content.index(text)].count("\n") + 1

    def test_own_file_and_line(self):
        self.refused("{sub: 3, name: sliding_gain,", "{sub: 3, gain: 1, name: sliding_gain,", "unknown key `gain`")

    def test_same_index_in_two_files(self):
        other = self.line_of(generate.SOURCE, "index: 0x2300\n")
        self.refused("index: 0x2310\n", "index: 0x2300\n",
                     f"index 2300h is used by position already, at {generate.SOURCE}:{other}")

    def test_same_sub_index_in_two_files(self):
        other = self.line_of("observers/emf.yaml", "{record: position, sub: 12,")
        self.refused("{record: position, sub: 18,", "{record: position, sub: 12,",
                     f"is used by emf_bandwidth already, at observers/emf.yaml:{other}", "observers/mismatch.yaml")

    def test_same_name_in_two_files(self):
        other = self.line_of(generate.SOURCE, "{sub: 2, name: R_s,")
        self.refused("name: sliding_gain,", "name: R_s,", f"is used at 2100h:02 already, at {generate.SOURCE}:{other}")

    def test_record_that_is_none(self):
        self.refused("{record: position, sub: 18,", "{record: nowhere, sub: 18,", "no record `nowhere`",
                     "observers/mismatch.yaml")

    def test_method_that_is_none(self):
        self.refused("[ekf_full, ekf_reduced]", "[ekf_full, ekf_half]",
                     "no method `ekf_half`: observers/ekf_half.h is not there", "observers/ekf_noise.yaml")

    def test_file_named_for_no_method(self):
        with Project() as project:
            (project.root / PART).rename(project.root / "observers/sliding.yaml")
            with self.assertRaisesRegex(SourceError, "^observers/sliding.yaml:.* no method `sliding`"):
                generate.files(project.root)

    def test_a_new_file_is_found(self):
        with Project() as project:
            member = 'record: position, sub: 90, name: tried, unit: "1", range: [0, 1], preset: 0, help: a trial'
            (project.root / "injection/trial.h").write_text("", encoding="utf-8")
            (project.root / "injection/trial.yaml").write_text(f"members:\n- {{{member}}}\n", encoding="utf-8")
            entry = generate.read(project.root).named("tried")
            self.assertEqual((entry.where, entry.methods, entry.access), ("2300h:5A", ("trial",), "live"))

    def test_methods(self):
        dictionary = generate.read(ROOT)
        for name, methods in (("pole_pairs", ()), ("sliding_gain", ("sliding_mode",)),
                              ("mismatch_current", ("mismatch",)), ("ekf_speed_noise", ("ekf_full", "ekf_reduced"))):
            self.assertEqual(dictionary.named(name).methods, methods)

    def test_a_row_more_is_a_value_more(self):
        with Project() as project:
            before = generate.read(project.root).named("observer")
            with open(project.root / LIST, "a", encoding="utf-8") as file:
                file.write('PM_METHOD(tried, "a trial", 0, 0)\n')
            after = generate.read(project.root).named("observer")
            self.assertEqual(after.values, {**before.values, before.most + 1: "a trial"})
            self.assertEqual((before.least, after.least, after.most), (0, 0, before.most + 1))

    def test_values_before_those_of_a_list(self):
        with Project() as project:
            project.replace("list: observers/observers.def,", "list: observers/observers.def, values: {0: none},")
            values = generate.read(project.root).named("observer").values
            self.assertEqual((values[0], values[1]), ("none", "active flux"))

    def test_list_with_a_range(self):
        self.refused("list: observers/observers.def,", "range: [0, 3], list: observers/observers.def,",
                     "the range follows from the list", generate.SOURCE)

    def test_list_that_is_none(self):
        self.refused("list: observers/observers.def,", "list: observers/observe.def,", "observers/observe.def: ",
                     generate.SOURCE)
        self.refused("list: observers/observers.def,", "list: observers/loop.h,", "has no row PM_METHOD",
                     generate.SOURCE)


class Mutations(unittest.TestCase):
    """Whatever is typed, the answer is files or a refusal that names the file; never another error."""

    PIECES = ("{", "}", "[", "]", ": ", "- ", "#", '"', "0x", "-1", "~", "&a ", "*a ", "1e9", "\t", "é", "...", "---",
              "$NODEID + ", "$x", "<<: ", "99999999999999999999", "? ", "\\")

    def mutate(self, random, text):
        at = random.randrange(len(text))
        kind = random.randrange(4)
        if kind == 0:
            return text[:at] + random.choice(self.PIECES) + text[at:]
        if kind == 1:
            return text[:at] + text[at + random.randint(1, 30) :]
        if kind == 2:
            return text[:at] + chr(random.randrange(32, 127)) + text[at + 1 :]
        lines = text.split("\n")
        lines[random.randrange(len(lines))] = random.choice(lines)
        return "\n".join(lines)

    def test_mutations(self):
        random = Random(402)
        refused = 0
        with Project() as project:
            for _ in range(150):
                text = GOOD
                for _ in range(random.randint(1, 3)):
                    text = self.mutate(random, text)
                (project.root / generate.SOURCE).write_text(text, encoding="utf-8")
                try:
                    generate.files(project.root)
                except SourceError as error:
                    refused += 1
                    self.assertRegex(str(error), r"(\w+\.yaml|allocations\.txt)(:\d+)?: ")
        self.assertGreater(refused, 75)


class Ledger(unittest.TestCase):
    """A place is never given twice."""

    def removed(self, project):
        project.replace(f"  - {POLE_PAIRS}\n", "")

    def refused(self, project, words):
        with self.assertRaisesRegex(SourceError, re.escape(words)):
            generate.files(project.root)

    def test_removed_without_a_word(self):
        with Project() as project:
            self.removed(project)
            self.refused(project, "2100h:01 `pole_pairs` is gone from parameters.yaml and not among `retired`")

    def test_retired(self):
        with Project() as project:
            self.removed(project)
            project.replace("retired: []", "retired: [{index: 0x2100, sub: 1, name: pole_pairs, why: a test}]")
            files = generate.files(project.root)
            self.assertIn("2100:01 i32 10^0_1 pole_pairs\n", files[generate.LEDGER])
            self.assertNotIn("pole_pairs", files["firmware/params/parameters.def"])

    def test_place_given_again(self):
        with Project() as project:
            project.replace(POLE_PAIRS, POLE_PAIRS.replace("pole_pairs", "other"))
            project.replace("retired: []", "retired: [{index: 0x2100, sub: 1, name: pole_pairs, why: a test}]")
            self.refused(project, "2100h:01 was `pole_pairs` and is never used again")

    def test_name_given_again(self):
        with Project() as project:
            project.replace(POLE_PAIRS, POLE_PAIRS.replace("sub: 1,", "sub: 100,"))
            project.replace("retired: []", "retired: [{index: 0x2100, sub: 1, name: pole_pairs, why: a test}]")
            self.refused(project, "is that of a retired object")

    def test_renamed(self):
        with Project() as project:
            project.replace(POLE_PAIRS, POLE_PAIRS.replace("pole_pairs", "poles"))
            self.refused(project, "2100h:01 was given to `pole_pairs`")

    def test_scaled_otherwise(self):
        with Project() as project:
            project.replace(POLE_PAIRS, POLE_PAIRS.replace("exp10: 0", "exp10: -1"))
            self.refused(project, "another meaning needs another place")

    def test_line_that_is_none(self):
        with Project() as project:
            project.replace("2100:01 i32", "2100.01 i32", generate.LEDGER)
            self.refused(project, "not a line of the ledger")

    def test_range_may_change(self):
        with Project() as project:
            project.replace(POLE_PAIRS, POLE_PAIRS.replace("[1, 50]", "[1, 60]"))
            generate.files(project.root)


def sheet(text):
    """What a data sheet says but its descriptions, and what CiA 306 takes for granted where it is missing."""
    parser = configparser.RawConfigParser(strict=True)
    parser.optionxform = str
    parser.read_string(text)
    said = {}
    for section in parser.sections():
        values = {key: int(value, 0) if re.fullmatch(r"0x[0-9A-F]+|-?[1-9][0-9]*|0", value) else value
                  for key, value in parser.items(section) if key != "Description"}
        if "DataType" in values:
            values = {"ObjectType": 7, "PDOMapping": 0} | ({"Factor": 1} if "Unit" in values else {}) | values
        said[section] = {key: value for key, value in values.items() if not re.match("(Creation|Modification)(Time|Date)|ModifiedBy", key)}
    said.pop("Comments", None)
    return said


class Made(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.files = generate.files(ROOT)
        cls.dictionary = generate.read(ROOT)

    def rows(self):
        return re.findall(r"^    \{(0x\w{4})U, (\d+)U, .*\},$", self.files["firmware/can/dictionary_table.c"], re.M)

    def test_table_is_sorted_and_complete(self):
        places = [(int(index, 16), int(sub)) for index, sub in self.rows()]
        self.assertEqual(places, sorted(set(places)))
        self.assertEqual(len(places), len(self.dictionary.entries))
        self.assertIn("od_count = sizeof od_table / sizeof od_table[0];", self.files["firmware/can/dictionary_table.c"])

    def test_slots_are_dense(self):
        for lives in ("node", "parameter", "live"):
            entries = self.dictionary.of(lives)
            last = [e for e in entries if model.is_mapping(e)]
            slots = [entry.slot for entry in [e for e in entries if e not in last] + last]
            self.assertEqual(slots, list(range(len(slots))), lives)

    def test_places_of_pdos_are_behind_the_words_pdo_by_pdo(self):
        first = int(re.search(r"OD_NODE_WORDS = (\d+),", self.files["firmware/can/dictionary_slots.h"])[1])
        places = [(index, sub) for index in (*range(0x1600, 0x1604), *range(0x1A00, 0x1A04)) for sub in range(1, 9)]
        found = {(e.index, e.sub): e.slot for e in self.dictionary.of("node") if model.is_mapping(e)}
        self.assertEqual(found, {place: first + n for n, place in enumerate(places)})

    def test_parameters_are_in_the_order_of_their_slots(self):
        names = re.findall(r"^PM_PARAM\((\w+),", self.files["firmware/params/parameters.def"], re.M)
        self.assertEqual(names, [entry.name for entry in self.dictionary.of("parameter")])

    def test_stored_values_fit_a_page(self):
        """firmware/params/store.h: 2 KiB in an image, 4 KiB where a program has every method. A page that is made on the host for a
        board has the parameters of every method, and with a bus load its bit rate."""
        stored = [entry for entry in self.dictionary.entries if entry.stored]
        self.assertEqual((pairs_of(2048), pairs_of(4096)), (249, 505))
        self.assertLessEqual(len(stored), pairs_of(4096))
        self.assertLess(sum(entry.lives == "parameter" for entry in stored), pairs_of(2048))
        for image in gen_images.images():
            held = [entry for entry in stored if not entry.methods or set(image.methods) & set(entry.methods)]
            self.assertLessEqual(len(held), pairs_of(2048), image.name)

    def test_stored_data_sheet(self):
        data = generate.stored_eds(self.files[generate.BYTES])
        text = lzma.decompress(data, format=lzma.FORMAT_ALONE).decode("ascii")
        whole = self.files[f"{generate.PACKAGE}/pmdrive.eds"]
        self.assertEqual(sheet(text), sheet(whole))
        self.assertLess(len(data), 5200)  # of 64 KiB of flash; 5009 with all of 151 parameters

    def test_bits_of_an_image(self):
        entry = next(e for e in self.dictionary.entries if e.index == 0x6502)
        self.assertEqual(entry.preset, sum(1 << (mode - 1) for mode in (3, 4)) + sum(1 << (15 - mode) for mode in (-1, -2, -3)))
        self.assertIn("    PM_HAS(six_step) ? 458764 : 196620,", self.files["firmware/can/dictionary_table.c"])

    def test_same_source_same_files(self):
        self.assertEqual(self.files, generate.files(ROOT))

    def test_another_compressor_changes_nothing(self):
        with Project() as project:
            first = generate.files(project.root)[generate.BYTES]
            data = generate.stored_eds(first)
            weak = lzma.compress(lzma.decompress(data), format=lzma.FORMAT_ALONE, preset=0)
            self.assertNotEqual(weak, data)
            generate.write(generate.BYTES, "stored_eds[] = {" + ",".join(f"0x{x:02X}" for x in weak) + "}",
                           project.root)
            self.assertEqual(generate.stored_eds(generate.files(project.root)[generate.BYTES]), weak)


if __name__ == "__main__":
    unittest.main()
