"""Rounded mantissas, and chunks that HDF5 decodes."""

import h5py
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from verlet_numba.run.compression import encode, round_mantissa

normal = st.floats(2.0**-100, 2.0**100, width=32) | st.floats(-(2.0**100), -(2.0**-100), width=32) | st.just(0.0)


@given(arrays(np.float32, 20, elements=normal), st.integers(1, 24))
def test_rounding_is_bounded_idempotent_and_leaves_the_last_bits_zero(values, bits):
    rounded = round_mantissa(values.copy(), bits)
    assert (np.abs(rounded.astype(float) - values) <= 2.0**-bits * np.abs(values.astype(float))).all()
    assert (rounded.view(np.uint32) & ((1 << (24 - bits)) - 1) == 0).all()
    np.testing.assert_array_equal(round_mantissa(rounded.copy(), bits), rounded)


@given(arrays(np.float32, (5, 7, 3), elements=normal))
def test_hdf5_decodes_an_encoded_chunk(values):
    with h5py.File("memory", "w", driver="core", backing_store=False) as file:
        dataset = file.create_dataset("x", values.shape, "f4", chunks=values.shape, compression="gzip", shuffle=True)
        dataset.id.write_direct_chunk((0, 0, 0), encode(values))
        np.testing.assert_array_equal(dataset[()], values)
