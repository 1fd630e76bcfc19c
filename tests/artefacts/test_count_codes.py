"""Every reason under which the sources count points has a code of its own, for programs."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.artefacts.count_codes import CODES, CODES_OF_PATTERNS, OTHER, code_of
from pipeline.artefacts.counts import counts_table

HOME = Path(__file__).parents[2]
SOURCES = [
    *(HOME / "pipeline" / "readers").glob("*.py"), *(HOME / "pipeline" / "target").glob("*.py"),
    *(HOME / "stages").glob("*.py"), HOME / "pipeline" / "artefacts" / "counts.py",
]  # fmt: skip
NOT_STREAMS = {"cast_checks.py"}  # rows of a cast are counted in messages alone
COUNTERS = {"dropped", "wrong", "counts"}
VARIABLE = "7"  # stands for what an f-string fills in
PASSED_ON = {
    ("row_filter.py", "reason"),  # RowFilter.keep's own
    ("file_summaries.py", "sensor"),  # lists of counts by sensor
}


def words(node: ast.expr) -> Iterator[str]:
    """Literal words of a reason; those of both branches of a condition."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.JoinedStr):
        yield "".join(part.value if isinstance(part, ast.Constant) else VARIABLE for part in node.values)
    elif isinstance(node, ast.IfExp):
        yield from words(node.body)
        yield from words(node.orelse)


def name_of(node: ast.AST) -> str:
    while isinstance(node, ast.Subscript):
        node = node.value
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


def keys_within(node: ast.AST) -> Iterator[ast.expr]:
    for inner in ast.walk(node):
        if isinstance(inner, ast.Dict):
            yield from (key for key in inner.keys if key is not None and list(words(key)))


def reasons_within(tree: ast.AST) -> Iterator[ast.expr]:
    """Expressions of reasons under which something is counted."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            name, owner = name_of(node.func), getattr(node.func, "value", None)
            if name == "keep" and len(node.args) == 2:
                yield node.args[1]
            elif name == "_counts":
                yield from (argument for argument in node.args if list(words(argument)))
            elif name == "Counter" or (name == "append" and owner is not None and name_of(owner) in COUNTERS):
                yield from keys_within(node)
        elif isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store) and name_of(node) in COUNTERS:
            yield node.slice
        elif isinstance(node, ast.FunctionDef) and node.name == "_counts":
            yield from keys_within(node)
        if isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign) and node.value is not None:
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            if any(name_of(target) in COUNTERS for target in targets):
                yield from keys_within(node.value)


def counted() -> dict[str, set[str]]:
    """Return the files that count a reason, by reason."""
    files: dict[str, set[str]] = {}
    for path in SOURCES:
        if path.name in NOT_STREAMS:
            continue
        for node in reasons_within(ast.parse(path.read_text(encoding="utf-8"))):
            reasons = list(words(node))
            assert reasons or (path.name, ast.unparse(node)) in PASSED_ON, f"{path.name}: {ast.unparse(node)}"
            for reason in reasons:
                files.setdefault(reason, set()).add(path.name)
    return files


COUNTED = counted()


@pytest.mark.parametrize("reason", sorted(COUNTED))
def test_every_reason_that_is_counted_has_a_code(reason: str) -> None:
    assert code_of(reason) != OTHER, f"{reason!r} of {', '.join(sorted(COUNTED[reason]))}: give it a code"


def test_no_two_reasons_share_a_code() -> None:
    codes = [code_of(reason) for reason in COUNTED]
    assert len(codes) == len(set(codes))
    listed = [*CODES.values(), *CODES_OF_PATTERNS.values(), OTHER]
    assert len(listed) == len(set(listed))
    assert all(re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", code) for code in listed)


def test_no_code_is_of_a_reason_that_nobody_counts() -> None:
    assert {code_of(reason) for reason in COUNTED} == {*CODES.values(), *CODES_OF_PATTERNS.values()}
    assert CODES.keys() <= COUNTED.keys()


@pytest.mark.parametrize(
    ("reason", "code"),
    [
        ("ins status INS_ALIGNING", "ins_status"), ("ins status 13", "ins_status"), ("quality Q 6", "quality"),
        ("quality Q nan", "quality"), ("quality Q -1.5", "quality"), ("quality Q of another number", "other_quality"),
        ("INSPVA beside INSPVAS", "other_record"), ("a number nobody knows", OTHER), ("", OTHER),
    ],
)  # fmt: skip
def test_a_reason_with_a_variable_part_has_one_code(reason: str, code: str) -> None:
    assert code_of(reason) == code


def test_the_table_has_the_code_beside_the_words() -> None:
    table = counts_table({"ins": [("a", {"quality Q 5": 2}), ("b", {"quality Q 5": 1, "quality Q 6": 1, "used": 4})]})
    assert table.to_dict("split")["columns"] == ["source", "reason", "code", "count"]
    assert table.to_numpy().tolist() == [
        ["ins", "quality Q 5", "quality", 3], ["ins", "quality Q 6", "quality", 1], ["ins", "used", "used", 4]
    ]  # fmt: skip
