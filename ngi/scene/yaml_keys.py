"""YAML that anybody may have written, read key by key; errors name file, key and value."""

import reprlib
import sys
from dataclasses import dataclass, field
from difflib import get_close_matches
from math import isfinite
from pathlib import Path
from typing import Any

import yaml
from yaml.composer import Composer, ComposerError

Vector = tuple[float, ...]


LARGEST_INTEGER = 2**31 - 1
"""What Mitsuba takes."""

_SHORT = reprlib.Repr()
_SHORT.maxlevel, _SHORT.maxlist, _SHORT.maxtuple, _SHORT.maxdict = 3, 30, 30, 10
_SHORT.maxstring = _SHORT.maxother = 200


@dataclass
class YamlKeys:
    """The keys of one mapping of the YAML; each is taken once, and none may be left over."""

    path: Path
    prefix: str
    values: Any
    taken: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        if not isinstance(self.values, dict):
            place = self.prefix.rstrip(".")
            raise ValueError(
                f"{self.path}: {place} is {_SHORT.repr(self.values)}; expected keys and values"
            )

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def error(self, key: str, value: object, advice: str) -> ValueError:
        return ValueError(f"{self.path}: {self.prefix}{key} is {_SHORT.repr(value)}; {advice}")

    def take(self, key: str, kind: type) -> Any:
        if key not in self.values:
            near = get_close_matches(key, map(str, self.values.keys() - self.taken), n=1)
            advice = f", or is '{near[0]}' meant to be it?" if near else ""
            raise ValueError(f"{self.path}: {self.prefix}{key} is missing; add it{advice}")
        self.taken.add(key)
        value = self.values[key]
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not object):
            raise self.error(key, value, f"expected {kind.__name__}")
        return value

    def positive_integer(self, key: str) -> int:
        value: int = self.take(key, int)
        if not 1 <= value <= LARGEST_INTEGER:
            raise self.error(key, value, f"expected a positive integer up to {LARGEST_INTEGER}")
        return value

    def numbers(self, key: str, *, length: int) -> Vector:
        value = self.take(key, object)
        numbers = value if isinstance(value, list) else [value]
        if len(numbers) != length or not all(map(_is_finite_number, numbers)):
            text = any(isinstance(number, str) and _says_a_number(number) for number in numbers)
            hint = "; YAML reads 1e5 as text: write 1.0e+5" if text else ""
            raise self.error(key, value, f"expected {length} finite number(s){hint}")
        return tuple(map(float, numbers))

    def flag(self, key: str) -> bool:
        """Whether a key that may be left out says true."""
        if key not in self.values:
            return False
        self.taken.add(key)
        if not isinstance(self.values[key], bool):
            raise self.error(key, self.values[key], "expected true or false")
        return bool(self.values[key])

    def integers(self, key: str) -> list[int]:
        value = self.take(key, list)
        if not all(_is_finite_number(n) and isinstance(n, int) and n > 0 for n in value):
            raise self.error(key, value, "expected positive integers")
        return list(value)

    def names(self, key: str, *, at_least: int) -> tuple[str, ...]:
        """One name or a list of different ones."""
        value = self.take(key, object)
        names = value if isinstance(value, list) else [value]
        if not all(isinstance(name, str) and name for name in names):
            raise self.error(key, value, "expected a name or a list of names")
        if len(set(names)) != len(names) or len(names) < at_least:
            raise self.error(key, value, f"expected at least {at_least} different name(s)")
        return tuple(names)

    def vectors(self, key: str, *, length: int) -> tuple[Vector, ...]:
        """A list of at least one vector."""
        vectors = self.take(key, list)
        if not vectors:
            raise self.error(key, vectors, "give at least one")
        keys = YamlKeys(self.path, self.prefix, {f"{key}[{i}]": f for i, f in enumerate(vectors)})
        return tuple(keys.numbers(name, length=length) for name in keys.values)

    def frames(self, key: str, *, dimensions: int) -> tuple[Vector, ...]:
        """A list of at least one scene vector."""
        try:
            vectors = self.vectors(key, length=dimensions)
        except ValueError as error:
            views = "; for views of the camera there is the property camera_path"
            raise ValueError(f"{error}, a component of v each{views}") from error
        for i, vector in enumerate(vectors):
            if not all(0 <= number <= 1 for number in vector):
                advice = "every component of v lies between 0 and 1"
                raise self.error(f"{key}[{i}]", list(vector), advice)
        return vectors

    def check_range(self, low: Vector, high: Vector, *, strict: bool = False) -> None:
        """ValueError for a maximum below its minimum; strict: for one equal to it too."""
        if not all(a < b or (a == b and not strict) for a, b in zip(low, high, strict=True)):
            raise self.error("maximum", list(high), f"each must be above minimum {list(low)}")

    def finish(self) -> None:
        for key in self.values.keys() - self.taken:
            near = get_close_matches(str(key), sorted(self.taken), n=1)
            advice = f"did you mean '{near[0]}'?" if near else f"known are {sorted(self.taken)}"
            raise ValueError(f"{self.path}: unknown key '{self.prefix}{key}'; {advice}")


def _says_a_number(text: str) -> bool:
    try:
        return isfinite(float(text))
    except ValueError:
        return False


def _is_finite_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max  # not so for NaN, nor for integers that are too long


MOST_LEVELS = 64
MOST_VALUES = 1_000_000
"""Of a file, with every *alias counted as what it stands for."""


class _Loader(Composer, yaml.CSafeLoader):
    """YAML's safe loader, which refuses what that one takes.

    A key that is there twice, of which it would silently take the last; and nesting and aliases
    that stand for more than there is memory for. LibYAML parses: every command reads all scenes'
    files, which takes a third of a second by PyYAML's own parser.
    """

    def __init__(self, stream: str) -> None:
        yaml.CSafeLoader.__init__(self, stream)
        Composer.__init__(self)
        self._levels = 0
        self._sizes: dict[int, int] = {}

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        event: yaml.Event = self.peek_event()  # type: ignore[assignment]  # None: after the last
        self._levels += 1
        if self._levels > MOST_LEVELS:
            self._refuse(f"more than {MOST_LEVELS} levels", event)
        node: yaml.Node | None = super().compose_node(parent, index)
        self._levels -= 1
        if node is not None and id(node) not in self._sizes:
            if isinstance(event, yaml.AliasEvent):
                self._refuse("an alias within what it stands for", event)
            size = self._sizes[id(node)] = 1 + sum(self._sizes[id(n)] for n in _parts(node))
            if size > MOST_VALUES:
                self._refuse(f"more than {MOST_VALUES:,} values", event)
        return node

    def _refuse(self, problem: str, event: yaml.Event) -> None:
        raise ComposerError(problem=problem, problem_mark=event.start_mark)  # type: ignore[arg-type]

    def compose_mapping_node(self, anchor: Any) -> yaml.MappingNode:
        node: yaml.MappingNode = super().compose_mapping_node(anchor)
        seen: set[str] = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                problem = f"the key '{key.value}' is there twice; keep one of them"
                raise ComposerError(problem=problem, problem_mark=key.start_mark)
            seen.add(key.value)
        return node


def _parts(node: yaml.Node) -> list[yaml.Node]:
    if isinstance(node, yaml.MappingNode):
        return [part for pair in node.value for part in pair]
    return list(node.value) if isinstance(node, yaml.SequenceNode) else []


def load_yaml(path: Path) -> dict[str, Any]:
    """The file's mapping.

    Raises ValueError, naming the file and where possible the line, for broken YAML, a key that is
    there twice, nesting without end and text that is not UTF-8.
    """
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else "?"
        raise ValueError(f"{path}, line {line}: broken YAML: {error.problem}") from None
    except yaml.YAMLError as error:
        raise ValueError(f"{path}: broken YAML: {' '.join(str(error).split())}") from None
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not UTF-8 ({error}); save it in that encoding") from None
    except OSError:
        raise
    except Exception as error:  # PyYAML raises nearly anything for a value that is no such thing
        raise ValueError(f"{path}: broken YAML: {type(error).__name__}: {error}") from None
    if not isinstance(content, dict):
        raise ValueError(f"{path}: expected keys and values, got {type(content).__name__}")
    return content
