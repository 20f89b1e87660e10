"""Where a source can be mutated, and into what: read from clang's syntax tree, so that each mutant compiles.

Not mutated: what must be constant when it is compiled (case labels, array sizes, tables), the insides of macros, and
what an image leaves out.
"""
import re
from dataclasses import dataclass, field

from clang.cindex import CursorKind as K
from clang.cindex import Index, StorageClass, TranslationUnit, TypeKind

FUNCTIONS = (K.FUNCTION_DECL, K.CXX_METHOD, K.CONSTRUCTOR, K.DESTRUCTOR, K.LAMBDA_EXPR, K.FUNCTION_TEMPLATE)
CLOSED = (K.STATIC_ASSERT, K.ENUM_DECL, K.CXX_UNARY_EXPR, K.TYPE_REF, K.TYPEDEF_DECL)
LOOPS = (K.FOR_STMT, K.WHILE_STMT, K.DO_STMT)
INTEGERS = (TypeKind.CHAR_S, TypeKind.SCHAR, TypeKind.UCHAR, TypeKind.SHORT, TypeKind.USHORT, TypeKind.INT,
            TypeKind.UINT, TypeKind.LONG, TypeKind.ULONG, TypeKind.LONGLONG, TypeKind.ULONGLONG)
UNSIGNED = (TypeKind.UCHAR, TypeKind.USHORT, TypeKind.UINT, TypeKind.ULONG, TypeKind.ULONGLONG)
# Where a number is a value, no index.
GIVEN = (K.VAR_DECL, K.INIT_LIST_EXPR, K.RETURN_STMT, K.CALL_EXPR, K.CONDITIONAL_OPERATOR, K.BINARY_OPERATOR)
FLOATS = (TypeKind.FLOAT, TypeKind.DOUBLE)
OPERATORS = {
    "<": ("<=", ">="), "<=": ("<", ">"), ">": (">=", "<="), ">=": (">", "<"), "==": ("!=",), "!=": ("==",),
    "&&": ("||",), "||": ("&&",), "+": ("-",), "-": ("+",), "*": ("+",), "/": ("*",), "%": ("/",),
    "&": ("|",), "|": ("&",), "^": ("|",), "<<": (">>",), ">>": ("<<",),
}  # fmt: skip
ASSIGNMENTS = {"+=": "-=", "-=": "+=", "*=": "/=", "/=": "*=", "|=": "=", "&=": "=", "<<=": ">>=", ">>=": "<<=",
               "^=": "=", "%=": "="}
# Fixed point has functions where other code has operators.
CALLS = {"pm_min": "pm_max", "pm_max": "pm_min", "pm_add_sat": "pm_sub_sat", "pm_sub_sat": "pm_add_sat",
         "pm_mulh_add": "pm_mulh_sub", "pm_mulh_sub": "pm_mulh_add", "pm_zone_add": "pm_zone_sub",
         "pm_zone_sub": "pm_zone_add", "min": "max", "max": "min", "cos": "sin", "sin": "cos"}
# Functions whose call is replaced by the first argument.
IDENTITIES = {"pm_abs", "pm_clamp", "pm_sat", "pm_sat_positive", "pm_half", "pm_sqrt", "pm_narrow_sat", "fabs", "clamp",
              "pm_gain_add", "pm_frac_add"}
MEMBERS = {"d": "q", "q": "d", "alpha": "beta", "beta": "alpha"}


@dataclass
class Site:
    """A stretch of the source with the texts that may stand in its place; statement: it may only be left out."""

    start: int
    end: int
    what: list = field(default_factory=list)  # (name of the mutation, text); the text of a statement is ""
    statement: bool = False
    function: str = ""


class Reader:
    """Collects the sites of one file."""

    def __init__(self, path, arguments):
        self.raw = path.read_bytes()
        options = TranslationUnit.PARSE_DETAILED_PROCESSING_RECORD
        self.unit = Index.create().parse(str(path), args=arguments, options=options)
        self.path = str(path)
        self.sites = []
        self.function = ""
        self.plus_plus = "c++" in " ".join(arguments)
        self.macros = set()
        self.shared = self._macro_arguments()
        for cursor in self.unit.cursor.get_children():
            if self._here(cursor):
                self._find_functions(cursor)

    def _here(self, cursor):
        file = cursor.location.file
        return file is not None and file.name == self.path

    def _macro_arguments(self):
        """Stretches of the file that are uses of macros."""
        ranges = []
        for cursor in self.unit.cursor.get_children():
            if cursor.kind == K.MACRO_INSTANTIATION and self._here(cursor):
                start, end = cursor.extent.start.offset, cursor.extent.end.offset
                ranges.append((start, end))
                self.macros.add((start, end))
        return ranges

    def _text(self, start, end):
        return self.raw[start:end].decode()

    def _cut(self, start, end):
        """Whether the stretch begins or ends within the use of a macro."""
        return any(s < start < e or s < end < e for s, e in self.shared)

    def _find_functions(self, cursor):
        if cursor.kind in FUNCTIONS and cursor.is_definition():
            self.function = cursor.spelling
            for child in cursor.get_children():
                if child.kind in (K.COMPOUND_STMT, K.INTEGER_LITERAL) or child.kind.is_expression():
                    self._visit(child, cursor, cursor)
        elif cursor.kind in (K.NAMESPACE, K.CLASS_DECL, K.STRUCT_DECL, K.LINKAGE_SPEC, K.UNEXPOSED_DECL,
                             K.CLASS_TEMPLATE):
            for child in cursor.get_children():
                self._find_functions(child)

    def _add(self, cursor, what, statement=False):
        start, end = cursor.extent.start.offset, cursor.extent.end.offset
        if start >= end or self._cut(start, end):
            return
        self.sites.append(Site(start, end, what, statement, self.function))

    def _visit(self, cursor, parent, grandparent):
        start, end = cursor.extent.start.offset, cursor.extent.end.offset
        if not self._here(cursor) or cursor.kind in CLOSED:
            return
        if (start, end) in self.macros:
            self._macro(cursor, parent)
            return
        children = list(cursor.get_children())
        if cursor.kind == K.VAR_DECL:
            fixed = cursor.storage_class == StorageClass.STATIC or "constexpr" in self._text(start, end).split("=")[0]
            if fixed and not self.plus_plus:
                return
            if cursor.type.kind == TypeKind.CONSTANTARRAY:
                children = [child for child in children if child.kind != K.INTEGER_LITERAL]
        if cursor.kind == K.CASE_STMT:
            children = children[1:]
        self._mutate(cursor, children, parent, grandparent)
        for child in children:
            self._visit(child, cursor, parent)

    def _macro(self, cursor, parent):
        """A constant with a name, PM_Q(0.5): a quarter less, and 1 less, so that 0 and 1 change as well."""
        text = self._text(cursor.extent.start.offset, cursor.extent.end.offset)
        kind = cursor.type.get_canonical().kind
        if text in ("true", "false"):
            self._add(cursor, [(f"{text} -> {'false' if text == 'true' else 'true'}", str(int(text == "false")))])
        elif cursor.kind.is_expression() and kind in INTEGERS + FLOATS and parent.kind != K.CASE_STMT:
            self._add(cursor, [(f"{text} -> 3/4 of it - 1", f"({text}) - ({text}) / 4 - 1")])

    def _mutate(self, cursor, children, parent, grandparent):
        kind = cursor.kind
        if kind == K.BINARY_OPERATOR and len(children) == 2:
            self._binary(cursor, children)
        elif kind == K.COMPOUND_ASSIGNMENT_OPERATOR and len(children) == 2:
            self._binary(cursor, children, ASSIGNMENTS)
        elif kind == K.UNARY_OPERATOR:
            self._unary(cursor, children, grandparent)
        elif kind == K.INTEGER_LITERAL:
            compares = parent.kind == K.BINARY_OPERATOR and self._operator(parent, list(parent.get_children())) != "="
            self._literal(cursor, cursor if compares else parent)
        elif kind == K.FLOATING_LITERAL:
            text = self._text(cursor.extent.start.offset, cursor.extent.end.offset)
            if text:
                zero = float(text.rstrip("fF") or 1) == 0
                self._add(cursor, [(f"{text} -> {'1.0' if zero else 'twice'}", "1.0" if zero else f"2 * {text}")])
        elif kind == K.CXX_BOOL_LITERAL_EXPR:
            text = self._text(cursor.extent.start.offset, cursor.extent.end.offset)
            other = "false" if text == "true" else "true"
            self._add(cursor, [(f"{text} -> {other}", other)])
        elif kind == K.CALL_EXPR:
            self._call(cursor)
        elif kind == K.MEMBER_REF_EXPR:
            self._member(cursor, parent)
        elif kind in (K.IF_STMT, K.CONDITIONAL_OPERATOR, K.RETURN_STMT) and children:
            self._condition(cursor, children[0])
        if kind in (K.COMPOUND_STMT, K.CASE_STMT, K.DEFAULT_STMT):
            for child in children:
                self._statement(child)

    def _operator(self, cursor, children):
        gap = self._text(children[0].extent.end.offset, children[1].extent.start.offset)
        return re.sub(r"/\*.*?\*/|//[^\n]*", "", gap, flags=re.S).strip().strip("()").strip()

    def _binary(self, cursor, children, table=None):
        operator = self._operator(cursor, children)
        others = (table or OPERATORS).get(operator)
        if others is None:
            return
        if isinstance(others, str):
            others = (others,)
        left, right = children
        pointers = [c.type.get_canonical().kind == TypeKind.POINTER for c in children]
        if pointers[0] and operator not in ("==", "!=", "<", "<=", ">", ">="):
            return
        a, b = cursor.extent.start.offset, cursor.extent.end.offset
        gap_start, gap_end = left.extent.end.offset, right.extent.start.offset
        gap = self._text(gap_start, gap_end)
        what = []
        for other in others:
            text = self._text(a, gap_start) + gap.replace(operator, other, 1) + self._text(gap_end, b)
            what.append((f"{operator} -> {other}", text))
        self._add(cursor, what)

    def _unary(self, cursor, children, grandparent):
        text = self._text(cursor.extent.start.offset, cursor.extent.end.offset)
        if text.startswith(("++", "--")) or text.endswith(("++", "--")):
            if grandparent.kind not in LOOPS and cursor.type.get_canonical().kind in INTEGERS:
                other = text.replace("++", "@@").replace("--", "++").replace("@@", "--")
                self._add(cursor, [(f"{text} -> {other}", other)])
        elif text.startswith(("!", "-", "~")):
            self._add(cursor, [(f"{text[0]} left out", text[1:])])

    def _literal(self, cursor, parent):
        text = self._text(cursor.extent.start.offset, cursor.extent.end.offset)
        match = re.fullmatch(r"(0[xX][0-9a-fA-F]+|\d+)([uUlL]*)", text)
        if not match:
            return
        number = int(match[1], 0)
        designated = parent.kind == K.UNEXPOSED_EXPR and self.raw[parent.extent.start.offset:][:1] == b"."
        given = designated or parent.kind in GIVEN
        if text == "0" and given and parent.type.get_canonical().kind not in UNSIGNED:
            # 1 would be an LSB of a signal; of a byte or a word this is 1 as well.
            self._add(cursor, [("0 -> 2^20 + 1", "1048577")])
        elif number >= 16:
            self._add(cursor, [(f"{text} -> 3/4 of it", f"{text} - {text} / 4")])
        else:
            other = f"{0 if number == 1 else number + 1}{match[2]}"
            self._add(cursor, [(f"{text} -> {other}", other)])

    def _call(self, cursor):
        arguments = list(cursor.get_arguments())
        text = self._text(cursor.extent.start.offset, cursor.extent.end.offset)
        name = cursor.spelling
        if name in CALLS and arguments:
            other = re.sub(rf"\b{name}\b", CALLS[name], text, count=1)
            self._add(cursor, [(f"{name} -> {CALLS[name]}", other)])
        if name in IDENTITIES and arguments and arguments[0] is not None:
            first = arguments[0].extent
            self._add(cursor, [(f"{name}() left out", self._text(first.start.offset, first.end.offset))])

    def _member(self, cursor, parent):
        """Only where it is read."""
        other = MEMBERS.get(cursor.spelling)
        if other is None or parent.kind != K.UNEXPOSED_EXPR or parent.extent != cursor.extent:
            return
        text = self._text(cursor.extent.start.offset, cursor.extent.end.offset)
        changed = re.sub(rf"\b{cursor.spelling}$", other, text)
        if changed != text:
            self._add(cursor, [(f".{cursor.spelling} -> .{other}", changed)])

    def _condition(self, cursor, condition):
        """One that is no comparison is negated."""
        inner = condition
        while inner.kind in (K.UNEXPOSED_EXPR, K.PAREN_EXPR) and len(list(inner.get_children())) == 1:
            inner = list(inner.get_children())[0]
        if cursor.kind == K.RETURN_STMT and condition.type.get_canonical().kind != TypeKind.BOOL:
            return
        if inner.kind in (K.BINARY_OPERATOR, K.UNARY_OPERATOR, K.INTEGER_LITERAL, K.CXX_BOOL_LITERAL_EXPR):
            return
        if not condition.kind.is_expression() and inner.kind != K.CALL_EXPR:
            return
        text = self._text(condition.extent.start.offset, condition.extent.end.offset)
        if text not in ("true", "false"):
            self._add(condition, [("negated", f"!({text})")])

    def _statement(self, cursor):
        inner = cursor
        while inner.kind in (K.UNEXPOSED_EXPR, K.CSTYLE_CAST_EXPR) and list(inner.get_children()):
            inner = list(inner.get_children())[-1]
        leave_out = inner.kind in (K.CALL_EXPR, K.COMPOUND_ASSIGNMENT_OPERATOR, K.CONTINUE_STMT)
        if inner.kind == K.BINARY_OPERATOR:
            leave_out = self._operator(inner, list(inner.get_children())) == "="
        if inner.kind == K.UNARY_OPERATOR:
            text = self._text(inner.extent.start.offset, inner.extent.end.offset)
            leave_out = "++" in text or "--" in text
        if inner.kind == K.RETURN_STMT:
            leave_out = not list(inner.get_children())
        if leave_out:
            self._add(cursor, [("left out", "")], statement=True)


def find(path, arguments):
    """The sites of a file, outer before inner ones."""
    sites = Reader(path, arguments).sites
    return sorted(sites, key=lambda s: (s.start, -s.end, not s.statement))


def render(raw, sites):
    """The source with all mutants in it. sites: (site, numbers of its mutants), nested or apart."""
    tree, stack = [], []
    for site, numbers in sites:
        node = (site, numbers, [])
        while stack and stack[-1][0].end <= site.start:
            stack.pop()
        (stack[-1][2] if stack else tree).append(node)
        stack.append(node)

    def emit(start, end, nodes):
        out, at = [], start
        for site, numbers, inside in nodes:
            out.append(raw[at:site.start].decode())
            text = emit(site.start, site.end, inside)
            if site.statement:
                out.append(f"if (!PM_MUTANT({numbers[0]})) {text}")
            else:
                choices = "".join(f"PM_MUTANT({number}) ? ({other}) : "
                                  for number, (_, other) in zip(numbers, site.what))
                out.append(f"({choices}({text}))")
            at = site.end
        out.append(raw[at:end].decode())
        return "".join(out)

    return emit(0, len(raw), tree)


def errors(path, text, arguments):
    """Lines on which the mutated source does not compile; 0: elsewhere."""
    unit = Index.create().parse(str(path), args=arguments, unsaved_files=[(str(path), text)])
    return [d.location.line if d.location.file and d.location.file.name == str(path) else 0
            for d in unit.diagnostics if d.severity >= 3]
