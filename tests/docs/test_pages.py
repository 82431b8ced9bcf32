"""What the site is made of, and the pages beside it, which its strict build does not check."""

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest
import yaml

import ngi
from ngi.cli import VERBS
from ngi.scene import KINDS
from tests.docs.pages import ROOT

BESIDE = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "scenes/LICENSE.md"]


@pytest.fixture(scope="module")
def documentation() -> ModuleType:
    spec = importlib.util.spec_from_file_location("hook", ROOT / "tools" / "documentation.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def headings(page: Path) -> set[str]:
    """Anchors, as GitHub and MkDocs make them of plain titles."""
    titles = re.findall(r"^#+ (.+)$", page.read_text(), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("name", BESIDE)
def test_links_lead_somewhere(name: str) -> None:
    page = ROOT / name
    for link in re.findall(r"\]\(([^)]+)\)", page.read_text()):
        if link.startswith("https://"):
            continue
        target, _, anchor = link.partition("#")
        file = page.parent / target
        assert file.exists(), link
        assert not anchor or anchor in headings(file), link


def test_every_page_can_be_found_in_the_menu() -> None:
    _, _, menu = (ROOT / "mkdocs.yml").read_text().partition("\nnav:\n")
    shown = re.findall(r": (\S+\.md)$", menu, flags=re.MULTILINE)
    written = [str(page.relative_to(ROOT / "docs")) for page in (ROOT / "docs").rglob("*.md")]
    made = [page for page in shown if page.startswith("reference/")]
    assert sorted(shown) == sorted({*written, *made})


def test_readme_stays_a_front_door() -> None:
    assert len((ROOT / "README.md").read_text().splitlines()) <= 150


def test_the_scene_of_the_readme_is_the_tutorials() -> None:
    shown, made = (
        re.search(r"```yaml.*\n(name: lamp\n[^`]*)```", (ROOT / page).read_text())
        for page in ("README.md", "docs/tutorials/scene.md")
    )
    assert shown is not None
    assert made is not None
    assert shown[1] == made[1]


def test_every_option_has_its_place_in_the_reference(documentation: ModuleType) -> None:
    page = documentation.options()
    options = [file.relative_to(ROOT / "conf") for file in (ROOT / "conf").rglob("*/*.yaml")]
    for option in options:
        group, *names = option.with_suffix("").parts
        if group != "hydra":
            assert f"### {group}={'/'.join(names)}\n" in page
    for file in (ROOT / "sweeps").glob("*.yaml"):
        assert f"| `{file.stem}` |" in page


def test_every_verb_has_its_place_in_the_reference(documentation: ModuleType) -> None:
    page = documentation.commands()
    for name, verb in VERBS.items():
        assert f"| `ngi {name}` | {verb.help} |" in page


def test_the_citation_is_of_this_version() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == ngi.__version__
    assert f"## [{ngi.__version__}]" in (ROOT / "CHANGELOG.md").read_text()


def test_every_property_of_a_scene_is_in_the_table() -> None:
    rows = re.findall(r"^\| (`.*?) \|", (ROOT / "docs" / "scenes.md").read_text(), re.MULTILINE)
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    assert KINDS.keys() <= named
