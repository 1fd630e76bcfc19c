"""Mounts written into the text of session.yaml, through the YAML library that keeps comments (ruamel.yaml).

The text becomes YAML nodes, the nodes of the mounts are changed, and the nodes become text again. Comments, the order
of keys, quotes, block and flow style, line ends and a byte order mark stay. Unchanged lists and mappings in brackets,
and unchanged texts over several lines, are copied letter by letter. The library writes the rest in one style:

* the indentation of nested blocks and of lists is the same everywhere, that of the first one;
* there is one space after a key's colon and none before it, and a comment may move along its line;
* ``? key`` on a line of its own becomes ``key:``, and a redundant tag (``!!map``) is dropped;
* a changed mapping or list in brackets stands on one line.

The library loses a comment inside the brackets of a changed mapping or list. Therefore the edited text is read again.
The edit is refused unless the content is the intended one and every comment is there in its order.
"""

import re
from collections.abc import Iterator, Mapping
from io import StringIO
from pathlib import Path
from typing import Any

import yaml
from ruamel.yaml import YAML
from ruamel.yaml.nodes import CollectionNode, MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.tokens import CommentToken

from pipeline.config.yaml_file import content_of
from pipeline.errors import ConfigError

Content = dict[str, Any]
DOCUMENT = re.compile(  # the library keeps neither a byte order mark nor the text before --- and after ...
    r"(\ufeff?(?:(?:[#%].*)?\n)*---[ \t]*\n|\ufeff?)(.*?)(^\.\.\.(?:\s.*)?)?", re.DOTALL | re.MULTILINE
)
FIRST_MARKER = 0xF0000  # first of the characters for private use: each one replaces one copied text
MARKER = re.compile("([\U000f0000-\U0010fffd])\\1*")
TEXT_BLOCK = ("|", ">")
TAGS = {str: "tag:yaml.org,2002:str", float: "tag:yaml.org,2002:float", dict: "tag:yaml.org,2002:map",
        list: "tag:yaml.org,2002:seq"}  # fmt: skip
NULL = "tag:yaml.org,2002:null"
DIGITS = dict.fromkeys(("mount_covariance", "covariance"), ".9e")  # with a decimal point: YAML reads 1e-06 as text


def edit_mounts(text: str, blocks: Mapping[str, Content], path: Path) -> str:
    """Return the text of session.yaml with the blocks' keys set in each sensor's block.

    Parameters
    ----------
    text
        The present text of session.yaml, which :func:`~pipeline.config.yaml_file.content_of` accepts.
    blocks
        By sensor, values of ``mount``, ``mount_origin`` and ``mount_covariance``.
    path
        The file, for errors.

    Raises
    ------
    ConfigError
        A sensor's block has no ``format`` (a new mount is written after it), or the edit would change or lose something
        else.
    """
    for name in blocks:
        if "format" not in content_of(text, path).get(name, {}):
            raise ConfigError(f"{path}: {name}: has no format; add it")
    try:
        new = _edited(text, blocks)
    except Exception as error:  # the library may raise any exception for a text that it cannot write
        raise _refusal(path) from error
    check_edit(text, new, blocks, path)
    return new


def check_edit(before: str, after: str, blocks: Mapping[str, Content], path: Path) -> None:
    """Raise ConfigError unless the new text has the old content except for the blocks, and every comment.

    Parameters
    ----------
    before, after
        Texts of session.yaml.
    blocks
        By sensor, the keys to change, with their new values.
    path
        The file, for errors.
    """
    content = content_of(before, path)
    meant = content | {name: content[name] | block for name, block in blocks.items()}
    try:
        same = content_of(after, path) == meant
    except ConfigError:
        same = False
    if not same:
        raise _refusal(path)
    comments, kept = _comments(before), _comments(after)
    if kept != comments:
        lost = next((comment for comment in comments if comments.count(comment) > kept.count(comment)), comments[0])
        raise ConfigError(
            f"{path}: mount cannot be edited where it stands, for the comment {lost!r} would be lost; put it on a line "
            "of its own, outside brackets"
        )


def _refusal(path: Path) -> ConfigError:
    return ConfigError(
        f"{path}: mount cannot be edited where it stands; write laser and mbes as plain blocks, one key a line"
    )


def _comments(text: str) -> list[str]:
    """Return all comments in their order. They stand between YAML's tokens, or after the head (| or >) of a text."""
    comments: list[str] = []
    end = 0
    for token in yaml.scan(text, Loader=yaml.SafeLoader):
        start, stop = token.start_mark.index, token.end_mark.index
        is_block = isinstance(token, yaml.ScalarToken) and token.style in TEXT_BLOCK
        comments += re.findall("#.*", text[end:start] + (text[start:stop].partition("\n")[0] if is_block else ""))
        end = max(end, stop)
    return [comment.strip() for comment in comments + re.findall("#.*", text[end:])]


def _edited(text: str, blocks: Mapping[str, Content]) -> str:
    newline = "\r\n" if "\r\n" in text else "\n"
    parts = DOCUMENT.fullmatch(text.replace("\r\n", "\n"))
    assert parts is not None
    head, body, tail = parts.groups(default="")
    library = YAML()
    library.width = len(text) + 10_000  # so that no line is broken
    root = library.compose(body)
    _keep_indents(library, root)
    taken: list[str] = []
    for position, (key, node) in enumerate(root.value):
        if key.value in blocks:
            _edit_sensor(node, blocks[key.value], body, taken)
        else:
            root.value[position] = key, _taken_over(node, body, taken)
    stream = StringIO()
    library.serialize(root, stream)
    new = MARKER.sub(lambda marker: taken[ord(marker[1]) - FIRST_MARKER], stream.getvalue())
    new = new if body.endswith("\n") else new.removesuffix("\n")
    return (head + new + tail).replace("\n", newline)


def _keep_indents(library: YAML, root: Node) -> None:
    """Set the library's indents to those of the first nested block and of the first block list."""
    library.indent(mapping=2, sequence=4, offset=2)
    pairs = list(_nested_blocks(root))
    for parent, child in reversed(pairs):
        column = parent.start_mark.column
        if isinstance(child, MappingNode):
            library.map_indent = child.start_mark.column - column
        elif isinstance(parent, MappingNode):
            library.sequence_dash_offset = child.start_mark.column - column
            library.sequence_indent = child.value[0].start_mark.column - column


def _nested_blocks(parent: Node) -> Iterator[tuple[Node, Node]]:
    """Yield each nested block mapping or list, after the block that contains it: (outer, nested)."""
    if not isinstance(parent, CollectionNode) or parent.flow_style:
        return
    for item in parent.value:
        child = item[1] if isinstance(item, tuple) else item
        if isinstance(child, CollectionNode) and not child.flow_style:
            yield parent, child
            yield from _nested_blocks(child)


def _taken_over(node: Node, text: str, taken: list[str]) -> Node:
    """Return the node with a marker in place of each text that stands in brackets or over several lines.

    Parameters
    ----------
    node
        A node that does not change.
    text
        The text in which the node's marks (its start and end) count.
    taken
        Texts replaced by markers so far; this call adds to them.
    """
    start, end = node.start_mark, node.end_mark
    if isinstance(node, CollectionNode) and not node.flow_style:
        for position, item in enumerate(node.value):
            if isinstance(item, tuple):
                node.value[position] = item[0], _taken_over(item[1], text, taken)
            else:
                node.value[position] = _taken_over(item, text, taken)
        return node
    if isinstance(node, ScalarNode) and (start.line == end.line or node.style in TEXT_BLOCK):
        return node
    marker = chr(FIRST_MARKER + len(taken))
    taken.append(text[start.index : end.index])
    length = max(1, end.column - start.column)  # as long as the text's last line: a comment behind it stays in place
    return ScalarNode(TAGS[str], marker * length, comment=node.comment)


def _edit_sensor(sensor: Node, block: Content, text: str, taken: list[str]) -> None:
    """Set the block's keys in a sensor's mapping; new keys come after ``mount``, or ``format`` if that is new too."""
    places = {key.value: position for position, (key, _) in enumerate(sensor.value)}
    for key, position in places.items():
        name, node = sensor.value[position]
        node = _changed(node, block[key], key) if key in block else _taken_over(node, text, taken)
        sensor.value[position] = name, node
    missing = [(ScalarNode(TAGS[str], key), _new(block[key], key)) for key in block if key not in places]
    if missing:
        anchor = places.get("mount", places["format"])
        _move_comments(_last(sensor.value[anchor][1]), _last(missing[-1][1]))
        sensor.value[anchor + 1 : anchor + 1] = missing


def _changed(node: Node, value: Any, key: str) -> Node:
    """Return the node with a new value; in a mapping or a block list each entry keeps its place and its comment."""
    if isinstance(node, MappingNode) and isinstance(value, dict):
        there = {name.value for name, _ in node.value}
        kept = [(name, old) for name, old in node.value if name.value in value]
        node.value = [(name, _changed(old, value[name.value], name.value)) for name, old in kept]
        node.value += [(ScalarNode(TAGS[str], name), _new(value[name], name)) for name in value if name not in there]
        return node
    if isinstance(node, SequenceNode) and isinstance(value, list) and len(node.value) == len(value):
        is_matrix = isinstance(value[0], list)
        if not (is_matrix and node.flow_style):
            node.value = [_changed(old, entry, key) for old, entry in zip(node.value, value, strict=True)]
            return node
    new = _new(value, key)
    _last(new).comment = _last(node).comment
    return new


def _new(value: Any, key: str) -> Node:
    """Return a node with a value of the key; a matrix becomes a list of rows, one per line."""
    if isinstance(value, dict):
        pairs = [(ScalarNode(TAGS[str], name), _new(entry, name)) for name, entry in value.items()]
        return MappingNode(TAGS[dict], pairs, flow_style=True)
    if isinstance(value, list):
        matrix = bool(value) and isinstance(value[0], list)
        return SequenceNode(TAGS[list], [_new(entry, key) for entry in value], flow_style=not matrix)
    if value is None:
        return ScalarNode(NULL, "null")
    if isinstance(value, float):
        return ScalarNode(TAGS[float], format(value, DIGITS.get(key, ".6f")))
    return ScalarNode(TAGS[str], value, style='"')


def _last(node: Node) -> Node:
    """Return the node that carries the comment after this node: the last entry of a block, else the node itself."""
    if isinstance(node, CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _last(last[1] if isinstance(last, tuple) else last)
    return node


def _move_comments(old: Node, new: Node) -> None:
    """Move comment lines from below the old node to below the new one; a comment on the old node's own line stays."""
    if not old.comment or old.comment[0] is None:
        return
    comment = old.comment[0]
    is_text_block = isinstance(old, ScalarNode) and old.style in TEXT_BLOCK  # its last line has no place for a comment
    own, _, below = ("", "", comment.value) if is_text_block else comment.value.partition("\n")
    new.comment = [CommentToken(f"\n{below}", comment.start_mark), None]
    old.comment = [CommentToken(f"{own}\n", comment.start_mark) if own else None, *old.comment[1:]]
