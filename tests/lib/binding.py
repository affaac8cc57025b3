# SPDX-License-Identifier: MIT
"""ctypes binding of shim.c and Lib.c: NumPy arrays (or numbers) in, arrays out."""
import ctypes
import re

import numpy as np
from host_build import ROOT

I32, U32 = np.int32, np.uint32

# name: (its function from words to words, input types, output types)
SWEEPS = {
    "clarke": ("clarke_q15", (I32,) * 2, (I32,) * 2),
    "invclarke": ("invclarke_q15", (I32,) * 2, (I32,) * 3),
    "park": ("park_q15", (I32,) * 4, (I32,) * 2),
    "invpark": ("invpark_q15", (I32,) * 4, (I32,) * 2),
    "cossin": ("cossin_q15", (U32,), (I32,) * 2),
    "clarke3": ("clarke3_q15", (I32,) * 3, (I32,) * 2),
    "clarke_bc": ("clarke_bc_q15", (I32,) * 2, (I32,) * 2),
    "clarke_ca": ("clarke_ca_q15", (I32,) * 2, (I32,) * 2),
    "magnitude": ("magnitude_q15", (I32,) * 2, (I32,)),
    "circle_rest": ("circle_rest_q15", (I32,) * 2, (I32,)),
    "advance": ("advance_q15", (I32,) * 3, (I32,) * 2),
    **{name: (name, inputs, outputs) for name, inputs, outputs in (
        ("atan2", (I32,) * 2, (U32, U32)), ("polar_root", (U32,), (I32,)), ("polar_root_down", (U32,), (I32,)),
        ("polar_reciprocal", (U32,), (U32,)), ("polar_arctangent", (U32,), (U32,)), ("sincos", (U32,), (I32,) * 2),
        ("svm", (I32,) * 3, (I32,) * 3), ("svm_middle", (I32,) * 2, (I32,)), ("deadtime", (I32, U32), (I32,)),
        ("pi_hold", (I32,) * 3, (I32,)), ("pi_saturate", (I32,) * 3, (I32,) * 2), ("sat16", (I32,), (I32,)))},
}
# Lib.h and LibFoc.h: fields in, fields out
API = {"Clarke_Lib_Do": (3, 2), "InvClarke_Lib_Do": (2, 3), "Park_Lib_Do": (4, 2), "InvPark_Lib_Do": (4, 2),
       "Clarke3_Lib_Do": (3, 2), "ClarkeBC_Lib_Do": (3, 2), "ClarkeCA_Lib_Do": (3, 2), "Polar_Lib_Do": (2, 2),
       "SVM_Lib_Do": (3, 3)}


def constant(header, name):
    """The number that a header of lib/ defines under this name."""
    return int(re.search(rf"(?m)^#define {name}\s+(\d+)\b", (ROOT / "lib" / header).read_text()).group(1))


def array(values, dtype, shape=None):
    """As a contiguous array of the type; a value that does not fit is an error, not a wrap."""
    wide = np.asarray(values, dtype=np.int64)
    info = np.iinfo(dtype)
    assert wide.size == 0 or (wide.min() >= info.min and wide.max() <= info.max), "test input out of the type's range"
    wide = np.atleast_1d(wide)
    return np.ascontiguousarray(np.broadcast_to(wide, wide.shape if shape is None else shape).astype(dtype))


def pointer(values):
    return ctypes.c_void_p(values.ctypes.data)


class Pi(ctypes.Structure):
    _fields_ = [("kp_q9", ctypes.c_int32), ("ki_q15", ctypes.c_int32), ("integral_q9", ctypes.c_int32)]


class Pll(ctypes.Structure):
    _fields_ = [("angle_q32", ctypes.c_uint32), ("speed_q32", ctypes.c_int32)]


class Library:
    def __init__(self, path):
        self.dll = ctypes.CDLL(str(path))
        for name, (function, inputs, outputs) in SWEEPS.items():
            setattr(self, name, self._sweep(getattr(self.dll, "shipped_" + function), inputs, outputs))

    def _sweep(self, function, input_types, output_types):
        def call(*inputs):
            assert len(inputs) == len(input_types)
            shape = np.broadcast_shapes(*(np.shape(np.atleast_1d(values)) for values in inputs))
            words = np.stack([array(values, dtype, shape).view(I32) for values, dtype in zip(inputs, input_types)], -1)
            found = np.empty((*shape, len(output_types)), I32)
            self.dll.shim_sweep(function, *map(ctypes.c_size_t, (words[..., 0].size, len(input_types), len(output_types))),
                                pointer(words), pointer(found))
            results = [np.ascontiguousarray(found[..., k]).view(dtype).astype(np.int64) for k, dtype in enumerate(output_types)]
            return results[0] if len(results) == 1 else results
        return call

    def api(self, name, *fields, output_offset=None):
        """A function of Lib.h on one set of fields. With output_offset the output starts at that word of the input."""
        count_in, count_out = API[name]
        assert len(fields) == count_in
        memory = (ctypes.c_int32 * 16)(*([0] * 6), *fields)
        start = 0 if output_offset is None else 6 + output_offset
        base = ctypes.addressof(memory)
        getattr(self.dll, name)(ctypes.c_void_p(base + 24), ctypes.c_void_p(base + 4 * start))
        return tuple(memory[start:start + count_out])

    def pi_api(self, state, sample, overlap=None):
        """PI_Lib_Do once: (output, state afterwards). With overlap the output is that field of the input."""
        memory, fields = (ctypes.c_int32 * 4)(*sample, 0), (ctypes.c_int32 * 3)(*state)
        start = 3 if overlap is None else overlap
        self.dll.PI_Lib_Do(memory, fields, ctypes.c_void_p(ctypes.addressof(memory) + 4 * start))
        assert overlap is not None or tuple(memory[:3]) == tuple(sample)
        return memory[start], tuple(fields)

    def pi_steps(self, pi, errors, limit):
        """Run the controller; returns outputs and integrals."""
        errors = array(errors, I32)
        inputs = [errors, array(limit, I32, errors.shape)]
        results = [np.empty(errors.shape, I32), np.empty(errors.shape, I32)]
        self.dll.shim_pi(ctypes.c_size_t(errors.size), ctypes.byref(pi), *map(pointer, inputs + results))
        return [values.astype(np.int64) for values in results]

    def pll_steps(self, pll, measured):
        """Run the observer; returns angles and speeds."""
        measured = array(measured, U32)
        results = [np.empty(measured.shape, U32), np.empty(measured.shape, I32)]
        self.dll.shim_pll(ctypes.c_size_t(measured.size), ctypes.byref(pll), pointer(measured), *map(pointer, results))
        return [values.astype(np.int64) for values in results]

    def pll(self, angle_q32=0):
        pll = Pll(0, 12345)
        self.dll.shim_pll_reset(ctypes.byref(pll), ctypes.c_uint32(angle_q32))
        return pll
