"""Loads YAML that anybody may have written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from yaml.composer import Composer, ComposerError

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
