"""YAML text to plain data and positions."""

import re
import tracemalloc
from pathlib import Path

import pytest

from verlet_numba.scene.problems import SceneError
from verlet_numba.scene.source import MAX_BYTES, parse, read


def refused(text: str) -> list[tuple[int, int, str]]:
    with pytest.raises(SceneError) as caught:
        parse(text, "s.yaml")
    return [(problem.line, problem.column, problem.message) for problem in caught.value.problems]


@pytest.mark.parametrize(("text", "value"), [
    ("1e-3", 1e-3), ("1E5", 1e5), ("+.5", 0.5), ("-.5e+2", -50.0), ("1.", 1.0), ("0o17", 15), ("0x1F", 31),
    ("-12", -12), ("007", 7), ("true", True), ("False", False), ("null", None), ("~", None), ("", None),
    ("no", "no"), ("on", "on"), ("yes", "yes"), ("y", "y"), ("tRue", "tRue"), ("2001-12-14", "2001-12-14"),
    ("1_000", "1_000"), ("0b11", "0b11"), ("1:30", "1:30"), ("=", "="), ("'1'", "1"), ('"true"', "true"),
    ("1e", "1e"), (".", "."), ("1.2.3", "1.2.3"), ("9223372036854775807", 2**63 - 1), ("1" + "0" * 30, 1e30)])
def test_plain_scalars_follow_yaml_1_2(text: str, value: object) -> None:
    data = parse(f"a: {text}", "s.yaml").data["a"]
    assert data == value
    assert type(data) is type(value)


def test_positions_count_from_one_and_fall_back_to_what_encloses() -> None:
    source = parse("a: 1\nb:\n  - {c: 5, d: [1, 22]}\n", "s.yaml")
    assert source.where(("a",)) == (1, 4)
    assert source.where(("a",), key=True) == (1, 1)
    assert source.where(("b", 0, "c")) == (3, 9)
    assert source.where(("b", 0, "c"), key=True) == (3, 6)
    assert source.where(("b", 0, "d", 1)) == (3, 19)
    assert source.where(("b", 0, "missing")) == (3, 5)
    assert source.where(("b", 7)) == (3, 3)
    assert source.where(()) == (1, 1)


def test_columns_count_characters() -> None:
    assert parse("é: {ü: 1}", "s.yaml").where(("é", "ü"), key=True) == (1, 5)
    assert parse("a: 1\r\nb: 2\r\n", "s.yaml").where(("b",)) == (2, 4)


def test_aliases_share_their_value_and_its_positions() -> None:
    source = parse("a: &x {p: 1}\nb: *x\n", "s.yaml")
    assert source.data["b"] == {"p": 1}
    assert source.where(("b", "p")) == (1, 11)


@pytest.mark.parametrize(("text", "line", "column", "words"), [
    ("a: 1\nb: 2\na: 3\n", 3, 1, "second time"),
    ("a: !!str 5", 1, 4, "tags"),
    ("a: !!python/object/apply:os.system ['true']", 1, 4, "tags"),
    ("b: 1\na: .nan", 2, 4, "finite"),
    ("a: [1, -.INF]", 1, 8, "pinned"),
    ("a: 1e999", 1, 4, "too large"),
    ("a: 0x" + "f" * 5000, 1, 4, "too large"),
    ("a: 1\n2: 3", 2, 1, "text"),
    ("true: 3", 1, 1, "text"),
    ("? [a, b]\n: 3", 1, 3, "text"),
    ("a: *x", 1, 4, "anchor"),
    ("a: &x [*x]", 1, 8, "own anchor"),
    ("a: 1\n---\nb: 2", 2, 1, "second document"),
    ("a: [1, 2", 1, 9, "not YAML"),
    ("a: b: c", 1, 5, "not YAML"),
    ("a: 1\n\tb: 2", 2, 1, "tabs"),
    ("a: 1\nb: \x01", 2, 4, "not YAML"),
    ("a: 1\nb: \ud800", 2, 4, "Unicode"),
    ("%YAML 3.0\n---\na: 1", 1, 1, "not YAML"),
    ("# nothing\n", 1, 1, "empty"),
    ("", 1, 1, "empty")])
def test_what_is_refused_and_where(text: str, line: int, column: int, words: str) -> None:
    found = refused(text)
    assert found[0][:2] == (line, column)
    assert words in found[0][2]


def test_merge_keys_are_keys_like_any_other() -> None:
    assert parse("a: &x {p: 1}\nb: {<<: *x}", "s.yaml").data["b"] == {"<<": {"p": 1}}


def test_all_wrong_values_are_told_together() -> None:
    assert [found[0] for found in refused("a: .nan\nb: !x 1\nc: 1\nc: 2\n")] == [1, 2, 4]


BOMB = "a: &a [x,x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{name}: &{name} [{','.join(['*' + below] * 10)}]\n" for below, name in zip("abcdefgh", "bcdefghi", strict=True))
CHAIN = "k0: &k0 [[[[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]]]\n" + "".join(
    f"k{n}: &k{n} [[[[[[[[[[[[[[[[[[[[*k{n - 1}]]]]]]]]]]]]]]]]]]]]\n" for n in range(1, 100))


DEEP = "deep|nesting depth"         # the reader may have a bound of its own


@pytest.mark.parametrize(("text", "words"), [
    (BOMB, "expand"), (CHAIN, "deep"), ("[" * 5000, DEEP), ("[" * 5000 + "]" * 5000, DEEP), ("{a: " * 5000, DEEP),
    ("- " * 5000 + "1", "deep"), ("? " * 5000, "deep"), ("\n".join(" " * n + "a:" for n in range(2000)), "deep"),
    ("[" + "*a," * 5000, "anchor"), ("\n".join(f"k{n}: 1" for n in range(20_000)), "keys"),
    ("a: 1\n" * 20_000, "second time"), ("#" * (MAX_BYTES + 1), "MB")])
def test_hostile_text_is_refused_with_little_memory(text: str, words: str) -> None:
    tracemalloc.start()
    try:
        found = refused(text)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert re.search(words, found[-1][2])
    assert len(found) <= 1000
    assert peak < 60e6


def test_reading_refuses_what_is_no_text_file(tmp_path: Path) -> None:
    def failure(path: str | Path) -> tuple[str, int, int, str]:
        with pytest.raises(SceneError) as caught:
            read(path)
        problem, = caught.value.problems
        return problem.file, problem.line, problem.column, problem.message

    missing = tmp_path / "missing.yaml"
    assert failure(missing) == (str(missing), 1, 1, "cannot be read: No such file or directory")
    assert failure(tmp_path)[1:] == (1, 1, "cannot be read: Is a directory")
    assert failure("a\0b")[1:3] == (1, 1)
    latin = tmp_path / "latin.yaml"
    latin.write_bytes(b"a: 1\nname: caf\xe9\n")
    assert failure(latin)[1:3] == (2, 10)
    large = tmp_path / "large.yaml"
    large.write_bytes(b"#" * 17_000_000)
    assert "16 MB" in failure(large)[3]


def test_a_byte_order_mark_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "bom.yaml").write_bytes(b"\xef\xbb\xbfa: 1")
    assert parse(read(tmp_path / "bom.yaml"), "bom.yaml").data == {"a": 1}
