"""Where pyarrow takes its memory in a live run."""

import pyarrow as pa
import pyarrow.compute as pc

from vidtrack.output.parquet import memory_of_c


def test_arrow_gets_its_own_memory_back():
    before = pa.default_memory_pool().backend_name
    with memory_of_c():
        pool = pa.system_memory_pool()
        held = pool.bytes_allocated()
        array = pa.array(range(10_000))
        assert pool.bytes_allocated() - held >= array.nbytes == 80_000
    assert pa.default_memory_pool().backend_name == before
    assert pc.sum(array).as_py() == 49_995_000
