"""What is remembered of source files: only what their content says, and never a reason to fail."""

from pathlib import Path

import pytest

from pipeline.run import import_closure
from pipeline.run.known_imports import KnownImports


def test_kept_for_the_next_run(tmp_path: Path) -> None:
    file = tmp_path / "imports.json"
    known = KnownImports(file)
    assert known.get("a") is None
    known.put("a", (("pipeline.x", ""), ("pipeline", "y")))
    known.keep()
    assert KnownImports(file).get("a") == (("pipeline.x", ""), ("pipeline", "y"))
    assert [path.name for path in tmp_path.iterdir()] == ["imports.json"]


@pytest.mark.parametrize("content", ["", "{", "[]", "null", '{"a": 1}', '{"a": [["b"]]}', "\x00"])
def test_what_cannot_be_read_is_nothing(tmp_path: Path, content: str) -> None:
    file = tmp_path / "imports.json"
    file.write_text(content)
    known = KnownImports(file)
    assert known.get("a") is None
    known.put("a", (("b", "c"),))
    known.keep()
    assert KnownImports(file).get("a") == (("b", "c"),)


def test_a_folder_that_cannot_be_written_does_no_harm(tmp_path: Path) -> None:
    known = KnownImports(tmp_path / "missing" / "imports.json")
    known.put("a", ())
    known.keep()
    assert known.get("a") == ()
    assert list(tmp_path.iterdir()) == []


def test_another_content_is_another_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same path, name, size and time: the content decides."""
    monkeypatch.setattr(import_closure, "KNOWN", KnownImports(tmp_path / "imports.json"))
    found = []
    sources = {"a": "import pipeline.errors\n", "b": "import pipeline.config\n", "c": "import ast      #\n"}
    for folder, source in sources.items():
        path = tmp_path / folder / "pipeline" / "m.py"
        path.parent.mkdir(parents=True)
        path.write_text(source)
        found.append(import_closure.imported_modules(tmp_path / folder, path, "pipeline.m"))
    assert found == [["pipeline.errors"], ["pipeline.config"], []]


def test_where_a_file_names_a_program_its_folder_is_looked_at(tmp_path: Path) -> None:
    for folder, program in (("a", True), ("b", False)):
        path = tmp_path / folder / "pipeline" / "m.py"
        path.parent.mkdir(parents=True)
        path.write_text('START = "other.py"\n')
        if program:
            path.with_name("other.py").touch()
        expected = ["pipeline.other"] if program else []
        assert import_closure.imported_modules(tmp_path / folder, path, "pipeline.m") == expected
