"""The examples of the documentation, in the order in which they stand there."""

import pathlib
import re

import pytest

PAGES = sorted((pathlib.Path(__file__).resolve().parents[3] / "docs").glob("python.md"))


def examples(text):
    return re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_examples_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = examples(page.read_text(encoding="utf-8"))
    assert len(found) > 3
    names = {}
    for number, example in enumerate(found):
        exec(compile(example, f"{page.name}, example {number}", "exec"), names)


def test_the_page_is_there():
    assert [page.name for page in PAGES] == ["python.md"]


def test_a_wrong_example_is_noticed():
    (wrong,) = examples("text\n```python\nassert 1 == 2\n```\n```sh\nls\n```\n")
    with pytest.raises(AssertionError):
        exec(wrong, {})
