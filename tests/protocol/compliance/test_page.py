"""docs/compliance.md lists every rule, and every worker that breaks one."""

import ast
import re
from pathlib import Path

import protocol.compliance

PAGE = (Path(__file__).parents[3] / "docs" / "compliance.md").read_text()
RULES = Path(protocol.compliance.__file__).parent
WORKERS = Path(__file__).parent / "workers"


def functions() -> dict[str, ast.FunctionDef]:
    trees = [ast.parse(path.read_text()) for path in RULES.glob("test_*.py")]
    found = [node for tree in trees for node in tree.body if isinstance(node, ast.FunctionDef)]
    return {node.name: node for node in found if node.name.startswith("test_")}


def test_the_page_lists_every_rule():
    assert set(re.findall(r"\| `(test_\w+)` \|$", PAGE, re.MULTILINE)) == functions().keys()


def test_every_rule_says_what_it_is():
    assert [name for name, function in functions().items() if not ast.get_docstring(function)] == []


def test_the_page_lists_every_broken_worker():
    programs = {path.name for path in WORKERS.glob("*.py")} - {"proper_worker.py"}
    assert set(re.findall(r"^\| `(\w+\.py)` \|", PAGE, re.MULTILINE)) == programs
