// Python arrays as strided memory: views without copies, broadcasting by strides, new NumPy arrays.
#pragma once

#include <nanobind/nanobind.h>

#include <cstring>
#include <limits>
#include <stdexcept>

#include "armangle/armangle.hpp"

namespace binding {

namespace nb = nanobind;

/// An object passed by Python, with its type for the stub. The type is not checked, so that it costs nothing
/// in a call: a Buffer checks that there is memory, its user type and shape.
template <class Element>
struct ArrayHandle : nb::handle {
    static constexpr auto Name =
        nb::detail::const_name("numpy.typing.NDArray[") + Element::name + nb::detail::const_name("]");
    static bool check_(nb::handle) noexcept { return true; }
    ArrayHandle() = default;
    ArrayHandle(nb::handle h) noexcept : nb::handle(h) {}
    ArrayHandle(std::nullptr_t, nb::detail::steal_t) noexcept {}
};
struct Float64 {
    static constexpr auto name = nb::detail::const_name("numpy.float64");
};
struct Int64 {
    static constexpr auto name = nb::detail::const_name("numpy.int64");
};
struct Int8 {
    static constexpr auto name = nb::detail::const_name("numpy.int8");
};
struct UInt8 {
    static constexpr auto name = nb::detail::const_name("numpy.uint8");
};
struct Float32 {
    static constexpr auto name = nb::detail::const_name("numpy.float32");
};
using Floats = ArrayHandle<Float64>;
using Ints = ArrayHandle<Int64>;
using Codes = ArrayHandle<Int8>;
using Bytes = ArrayHandle<UInt8>;
using Singles = ArrayHandle<Float32>;

/// A view of an object's memory; the destructor releases the view. The caller checks type and shape.
class Buffer {
public:
    Buffer() = default;
    /// Acquires the memory of an object; raises if it has none, or if it is read-only and `writable`.
    Buffer(nb::handle object, bool writable = false) { get(object, writable); }
    Buffer(const Buffer&) = delete;
    Buffer& operator=(const Buffer&) = delete;
    ~Buffer() { release(); }

    /// Acquires the memory of an object. Returns false, without setting an error, if the object offers no
    /// such memory.
    bool try_get(nb::handle object, bool writable = false) noexcept {
        const int flags = PyBUF_STRIDES | PyBUF_FORMAT | (writable ? PyBUF_WRITABLE : 0);
        if (PyObject_GetBuffer(object.ptr(), &view_, flags) == 0) return held_ = true;
        PyErr_Clear();
        return false;
    }
    /// Acquires the memory of an object; raises if it has none, or if it is read-only and `writable`.
    void get(nb::handle object, bool writable = false) {
        if (!try_get(object, writable)) throw std::invalid_argument("an array was expected");
    }
    /// Releases the memory.
    void release() noexcept {
        if (held_) PyBuffer_Release(&view_);
        held_ = false;
    }

    /// Whether memory is acquired.
    bool held() const noexcept { return held_; }
    /// The number of axes.
    int ndim() const noexcept { return view_.ndim; }
    /// The length of axis i.
    Py_ssize_t shape(int i) const noexcept { return view_.shape[i]; }
    /// The bytes from one element to the next along axis i.
    Py_ssize_t stride(int i) const noexcept { return view_.strides[i]; }
    /// Whether the elements are of this kind: 'd' (double), 'f' (float) or 'l' (any integer of 8 bytes).
    bool is(char kind) const noexcept {
        const char* f = view_.format;
        if (!f || f[1]) return false;
        return kind == 'd' || kind == 'f' ? *f == kind : ((*f == 'l' || *f == 'q') && view_.itemsize == 8);
    }
    /// Points to the first element; T must be its type, which is not checked.
    template <class T>
    T* data() const noexcept {
        return static_cast<T*>(view_.buf);
    }

    /// Whether the view is a C-contiguous array of exactly these extents and of this kind, as in is().
    bool is_array(char kind, std::initializer_list<Py_ssize_t> extents) const noexcept {
        if (!is(kind) || ndim() != static_cast<int>(extents.size())) return false;
        Py_ssize_t step = view_.itemsize;
        for (int i = ndim() - 1; i >= 0; --i) {
            if (shape(i) != extents.begin()[i] || stride(i) != step) return false;
            step *= shape(i);
        }
        return true;
    }

    /// The number of elements in a batch: the product of all extents but the `inner` last.
    std::size_t elements(int inner) const noexcept {
        std::size_t count = 1;
        for (int i = 0; i < ndim() - inner; ++i) count *= static_cast<std::size_t>(shape(i));
        return count;
    }

private:
    Py_buffer view_{};
    bool held_ = false;
};

/// Reads a Python float or int; false for anything else, bool included, and for an int that is too large.
inline bool as_double(nb::handle h, double& out) noexcept {
    if (PyFloat_Check(h.ptr())) {
        out = PyFloat_AS_DOUBLE(h.ptr());
        return true;
    }
    if (PyLong_CheckExact(h.ptr())) {
        out = PyLong_AsDouble(h.ptr());
        if (out == -1.0 && PyErr_Occurred()) {
            PyErr_Clear();
            return false;
        }
        return true;
    }
    return false;
}

/// Reads a Python int or NumPy integer as an index, clipped to 64 bits; false for anything else (bool and
/// float too).
inline bool as_index(nb::handle h, long long& out) noexcept {
    if (PyBool_Check(h.ptr()) || !PyIndex_Check(h.ptr())) return false;
    out = PyNumber_AsSsize_t(h.ptr(), nullptr);
    if (out != -1 || !PyErr_Occurred()) return true;
    PyErr_Clear();
    return false;
}

/// Corrects the pose m (16 numbers), but not its last row, for rounding to `precision` (ratio; 0: exact).
template <class AnyArm>
void correct_rounding(const AnyArm& arm, double precision, double* m) noexcept {
    if (!(precision > 0)) return;
    double last_row[4];
    std::memcpy(last_row, m + 12, sizeof(last_row));
    armangle::store_pose(within_rounding(arm, armangle::load_pose(m), precision), m);
    std::memcpy(m + 12, last_row, sizeof(last_row));  // the last row stays as given
}

/// Whether an object is a numpy.ma array, which may mark numbers as invalid.
inline bool is_masked_array(nb::handle object) noexcept {
    static PyObject* type = nb::object(nb::module_::import_("numpy.ma").attr("MaskedArray")).release().ptr();
    return PyObject_TypeCheck(object.ptr(), reinterpret_cast<PyTypeObject*>(type)) != 0;
}

/// Reads a small matrix (rows x columns; one row: a vector) from a float64 or float32 array in any order, or
/// from nested lists or tuples of numbers. Returns false for anything else: the general function then
/// answers, or raises the error.
class SmallMatrix {
public:
    /// Reads an array, or nested lists, of rows x columns numbers; false if it is anything else.
    bool read(nb::handle object, int rows, int columns, double* to) noexcept {
        if (PyList_CheckExact(object.ptr()) || PyTuple_CheckExact(object.ptr()))
            return read_rows(object, rows, columns, to);
        Buffer b;
        if (is_masked_array(object) || !b.try_get(object)) return false;
        if (b.is('d')) return read_array<double>(b, rows, columns, to);
        precision_ = std::numeric_limits<float>::epsilon();
        return b.is('f') && read_array<float>(b, rows, columns, to);
    }

    /// Reads a (4,4) pose of an arm into `to` and corrects float32 rounding; false if it is no array or
    /// nested list of 4 x 4 numbers.
    template <class AnyArm>
    bool read_pose(const AnyArm& arm, nb::handle object, double* to) noexcept {
        if (!read(object, 4, 4, to)) return false;
        correct_rounding(arm, precision_, to);
        return true;
    }

    /// The relative rounding of the numbers read; 0 if they are exact.
    double precision() const noexcept { return precision_; }

private:
    double precision_ = 0;

    /// Reads an array whose elements the caller knows to be of type T into `to`; false if the shape differs.
    template <class T>
    static bool read_array(const Buffer& b, int rows, int columns, double* to) noexcept {
        const bool vector = rows == 1;
        if (b.ndim() != (vector ? 1 : 2) || b.shape(b.ndim() - 1) != columns ||
            (!vector && b.shape(0) != rows))
            return false;
        const Py_ssize_t down = vector ? 0 : b.stride(0), across = b.stride(b.ndim() - 1);
        for (int i = 0; i < rows; ++i)
            for (int j = 0; j < columns; ++j) {
                T value;
                std::memcpy(&value, b.data<char>() + i * down + j * across, sizeof(T));
                to[i * columns + j] = static_cast<double>(value);
            }
        return true;
    }

    /// Reads a list or tuple of `count` numbers; false if it is anything else.
    static bool read_numbers(nb::handle sequence, int count, double* to) noexcept {
        if (!PyList_CheckExact(sequence.ptr()) && !PyTuple_CheckExact(sequence.ptr())) return false;
        if (PySequence_Fast_GET_SIZE(sequence.ptr()) != count) return false;
        PyObject** items = PySequence_Fast_ITEMS(sequence.ptr());
        for (int i = 0; i < count; ++i)
            if (!as_double(items[i], to[i])) return false;
        return true;
    }

    /// Reads a list or tuple of rows of numbers; false if it is anything else.
    static bool read_rows(nb::handle sequence, int rows, int columns, double* to) noexcept {
        if (rows == 1) return read_numbers(sequence, columns, to);
        if (PySequence_Fast_GET_SIZE(sequence.ptr()) != rows) return false;
        PyObject** items = PySequence_Fast_ITEMS(sequence.ptr());
        for (int i = 0; i < rows; ++i)
            if (!read_numbers(items[i], columns, to + i * columns)) return false;
        return true;
    }
};

/// The most rows of a batch that is answered like a single element: at once, without threads or progress.
inline constexpr Py_ssize_t few = 16;

/// The number n of rows, 1 to `few`, of a C-contiguous float64 array (n, inner...), which `rows` views; 0 for
/// anything else.
inline Py_ssize_t few_rows(nb::handle object, Buffer& rows,
                           std::initializer_list<Py_ssize_t> inner) noexcept {
    if (is_masked_array(object) || !rows.try_get(object)) return 0;
    if (!rows.is('d') || rows.ndim() != static_cast<int>(inner.size()) + 1) return 0;
    const Py_ssize_t n = rows.shape(0);
    if (n < 1 || n > few) return 0;
    Py_ssize_t step = rows.stride(rows.ndim() - 1), k = rows.ndim() - 1;
    if (step != static_cast<Py_ssize_t>(sizeof(double))) return 0;
    for (auto extent = inner.end(); extent != inner.begin(); --k) {
        if (rows.shape(static_cast<int>(k)) != *--extent || rows.stride(static_cast<int>(k)) != step)
            return 0;
        step *= *extent;
    }
    return n == 1 || rows.stride(0) == step ? n : 0;
}

/// The branches of n rows, which are not checked: one integer for all, or a C-contiguous int64 array (n,).
/// False for anything else.
inline bool few_branches(nb::handle object, Py_ssize_t n, long long (&gc)[few]) noexcept {
    if (as_index(object, gc[0])) {
        for (Py_ssize_t i = 1; i < n; ++i) gc[i] = gc[0];
        return true;
    }
    Buffer b;
    if (is_masked_array(object) || !b.try_get(object) || !b.is_array('l', {n})) return false;
    std::memcpy(gc, b.data<long long>(), static_cast<std::size_t>(n) * sizeof(long long));
    return true;
}

/// The function numpy.empty, kept for the lifetime of the process.
inline PyObject* numpy_empty() {
    static PyObject* function = nb::object(nb::module_::import_("numpy").attr("empty")).release().ptr();
    return function;
}

/// A new float64 array, not filled, of a shape, which is a Python int or tuple.
inline nb::object new_array(nb::handle shape) {
    PyObject* arguments[] = {shape.ptr()};
    PyObject* array = PyObject_Vectorcall(numpy_empty(), arguments, 1, nullptr);
    if (!array) throw nb::python_error();
    return nb::steal(array);
}

/// A new float64 array of shape (n, inner...), not filled.
template <class... Inner>
nb::object new_rows(Py_ssize_t n, Inner... inner) {
    return new_array(nb::make_tuple(n, inner...));
}

/// A new array (n,) of a type of NumPy, not filled.
inline nb::object new_rows_of(nb::handle type, Py_ssize_t n) {
    const nb::object length = nb::int_(n);
    PyObject* arguments[] = {length.ptr(), type.ptr()};
    PyObject* array = PyObject_Vectorcall(numpy_empty(), arguments, 2, nullptr);
    if (!array) throw nb::python_error();
    return nb::steal(array);
}

/// A new float64 array (7,), not filled.
inline nb::object new_array7() {
    static PyObject* seven = PyLong_FromLong(armangle::joints);
    return new_array(seven);
}

/// A new float64 array (4, 4), not filled.
inline nb::object new_array44() {
    static PyObject* shape = nb::make_tuple(4, 4).release().ptr();
    return new_array(shape);
}

/// Fills a float64 array with `count` numbers and returns it.
inline nb::object filled(nb::object array, const double* from, std::size_t count) {
    const Buffer to(array, true);
    std::memcpy(to.data<double>(), from, count * sizeof(double));
    return array;
}

/// The object numpy.float64(value).
inline nb::object numpy_float(double value) {
    static PyObject* type = nb::object(nb::module_::import_("numpy").attr("float64")).release().ptr();
    const nb::object number = nb::float_(value);
    PyObject* arguments[] = {number.ptr()};
    PyObject* made = PyObject_Vectorcall(type, arguments, 1, nullptr);
    if (!made) throw nb::python_error();
    return nb::steal(made);
}

/// The object numpy.int64(gc) of a branch 0..7; the eight objects are made once.
inline nb::object numpy_index(int gc) {
    static PyObject* known = [] {
        const nb::object type = nb::module_::import_("numpy").attr("int64");
        nb::list all;
        for (int k = 0; k < armangle::configurations; ++k) all.append(type(k));
        return nb::tuple(all).release().ptr();
    }();
    return nb::borrow(PyTuple_GET_ITEM(known, gc));
}

/// Makes a named tuple of a Python class from items, without calling the class's own __new__.
template <class... Items>
nb::object new_named(nb::handle kind, Items&&... items) {
    nb::object owned[] = {nb::cast(std::forward<Items>(items))...};
    auto* type = reinterpret_cast<PyTypeObject*>(kind.ptr());
    PyObject* made = type->tp_alloc(type, sizeof...(items));
    if (!made) throw nb::python_error();
#if PY_VERSION_HEX >= 0x030E0000
    reinterpret_cast<PyTupleObject*>(made)->ob_hash = -1;  // unknown; 0 would be a hash
#endif
    for (std::size_t i = 0; i < sizeof...(items); ++i)
        PyTuple_SET_ITEM(made, static_cast<Py_ssize_t>(i), owned[i].release().ptr());
    return nb::steal(made);
}

/// The common batch axes of several arrays that have been broadcast to one shape; axes that are contiguous in
/// all are merged.
template <int N>
class Grid {
public:
    /// Takes the batch axes of buffers[0], which all buffers have (the caller has broadcast them). A null
    /// buffer has stride 0; the first must not be null. The `inner[k]` trailing axes of buffer k belong to
    /// the element and are contiguous.
    Grid(const Buffer* const (&buffers)[N], const int (&inner)[N]) {
        const Buffer& lead = *buffers[0];
        ndim_ = lead.ndim() - inner[0];
        for (int d = 0; d < ndim_; ++d) {
            shape_[d] = lead.shape(d);
            for (int k = 0; k < N; ++k) stride_[d][k] = buffers[k] ? buffers[k]->stride(d) / 8 : 0;
        }
        collapse();
        size_ = 1;
        for (int d = 0; d < ndim_; ++d) size_ *= static_cast<std::size_t>(shape_[d]);
    }

    /// The number of elements.
    std::size_t size() const noexcept { return size_; }

    /// Calls run(flat index, offsets in elements of 8 bytes, strides, count) for each run of the last axis
    /// within [begin, end).
    template <class Run>
    void for_runs(std::size_t begin, std::size_t end, const Run& run) const {
        for_runs(begin, end, run, [](std::size_t) { return false; }, end - begin);
    }

    /// Calls run(flat index, offsets, strides, count) for each run of the last axis within [begin, end), in
    /// pieces of at most `piece` elements, until ended(elements done) is true.
    template <class Run, class Ended>
    void for_runs(std::size_t begin, std::size_t end, const Run& run, const Ended& ended,
                  std::size_t piece = 1024) const {
        const std::size_t row = ndim_ ? static_cast<std::size_t>(shape_[ndim_ - 1]) : 1;
        static constexpr Py_ssize_t none[N] = {};
        const Py_ssize_t* strides = ndim_ ? stride_[ndim_ - 1] : none;
        for (std::size_t i = begin; i < end;) {
            if (i > begin && ended(i - begin)) return;
            const std::size_t in_row = i % row, left = end - i < row - in_row ? end - i : row - in_row;
            const std::size_t count = left < piece ? left : piece;
            Py_ssize_t offset[N] = {};
            std::size_t rest = i;
            for (int d = ndim_ - 1; d >= 0; --d) {
                const auto extent = static_cast<std::size_t>(shape_[d]);
                for (int k = 0; k < N; ++k)
                    offset[k] += static_cast<Py_ssize_t>(rest % extent) * stride_[d][k];
                rest /= extent;
            }
            run(i, offset, strides, count);
            i += count;
        }
    }

private:
    /// Joins axes that one stride steps through, so that runs are long.
    void collapse() noexcept {
        for (int d = ndim_ - 1; d > 0; --d) {
            bool one = true;
            for (int k = 0; k < N; ++k) one &= stride_[d - 1][k] == stride_[d][k] * shape_[d];
            if (!one) continue;
            shape_[d - 1] *= shape_[d];
            for (int k = 0; k < N; ++k) stride_[d - 1][k] = stride_[d][k];
            for (int e = d; e + 1 < ndim_; ++e) {
                shape_[e] = shape_[e + 1];
                std::memcpy(stride_[e], stride_[e + 1], sizeof(stride_[e]));
            }
            --ndim_;
        }
    }

    static constexpr int most_axes = 64;
    int ndim_ = 0;
    std::size_t size_ = 0;
    Py_ssize_t shape_[most_axes] = {};
    Py_ssize_t stride_[most_axes][N] = {};
};

/// The bound arm with its limits, without margin.
struct ArmHandle {
    armangle::Arm arm;
    armangle::LimitTable limits;
};

/// The bound nearly S-R-S arm. It is no ArmHandle, so functions that do not support it cannot take it.
struct ChainArmHandle {
    armangle::ChainArm arm;
};

void bind_refusal(nb::module_& m);
void bind_poses(nb::module_& m);
void bind_kinematics(nb::module_& m, nb::class_<ArmHandle>& arm);
void bind_chain_kinematics(nb::class_<ChainArmHandle>& arm);
void bind_chain_arcs(nb::class_<ChainArmHandle>& arm);
void bind_chain_scenes(nb::class_<ChainArmHandle>& arm);
void bind_chain_reach(nb::class_<ChainArmHandle>& arm);
void bind_chain_stepping(nb::class_<ChainArmHandle>& arm);
void bind_scenes(nb::module_& m, nb::class_<ArmHandle>& arm);
void bind_arcs(nb::module_& m, nb::class_<ArmHandle>& arm);
void bind_stepping(nb::module_& m, nb::class_<ArmHandle>& arm);
void bind_planning(nb::module_& m, nb::class_<ArmHandle>& arm);
void bind_chain_planning(nb::class_<ChainArmHandle>& arm);
void bind_solving(nb::module_& m, nb::class_<ArmHandle>& arm);
void bind_chain_solving(nb::class_<ChainArmHandle>& arm);
void bind_tracking(nb::module_& m);
void bind_reach(nb::module_& m, nb::class_<ArmHandle>& arm);
void bind_kuka(nb::class_<ArmHandle>& arm);

}  // namespace binding
