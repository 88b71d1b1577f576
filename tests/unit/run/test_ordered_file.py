"""A file whose bytes reach the disk in order."""

from hypothesis import given
from hypothesis import strategies as st

from verlet_numba.run.ordered_file import OrderedFile


@given(st.lists(st.tuples(st.integers(0, 60), st.binary(min_size=1, max_size=30)), max_size=12), st.integers(0, 12))
def test_an_ordered_file_reads_as_written_and_is_whole_on_the_disk_after_flush(tmp_path_factory, writes, flush_after):
    path = tmp_path_factory.mktemp("ordered") / "file"
    file, expected = OrderedFile(path, create=True), bytearray()
    for number, (start, data) in enumerate(writes):
        expected.extend(bytes(max(0, start + len(data) - len(expected))))
        expected[start:start + len(data)] = data
        file.seek(start)
        file.write(memoryview(data))
        file.seek(0)
        assert file.read() == expected
        if number == flush_after:
            file.flush()
            assert path.read_bytes() == expected
    file.flush()
    assert path.read_bytes() == expected
    file.close()
