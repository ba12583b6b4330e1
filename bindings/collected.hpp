// Arc sets collected by many threads, and the arrays that Python receives.
//
// The number of arcs of a pose is known only after it is solved, and a million poses have millions of arcs.
// So each thread writes into its part of one array, sized for the usual number. A thread that outgrows its
// part allocates its own memory. At the end the parts are merged, mostly without a copy into new memory.
// Growing and joining vectors took as long as solving the poses.
#pragma once

#include <nanobind/ndarray.h>

#include <memory>
#include <vector>

#include "buffers.hpp"

namespace binding {

using namespace armangle;

/// count per set; for each arc its two ends as angle, joint, side and value in q; status per set. With a
/// scene also, for each end, the pair of obstacle and link that causes it, and per set a pair that blocks it,
/// if one is known, and whether narrow arcs may be missing.
using ArcColumns =
    nb::typed<nb::tuple, Ints, Floats, Codes, Codes, Floats, Codes, nb::object, nb::object, nb::object>;

/// Moves values into a NumPy array with this number of columns, without a copy.
template <class T>
nb::object owned(std::vector<T>&& values, std::size_t columns) {
    auto* kept = new std::vector<T>(std::move(values));
    nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    const std::size_t rows = kept->size() / columns;
    if (columns == 1) return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), {rows}, owner));
    return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), {rows, columns}, owner));
}

/// Memory that grows without initialization: its own, or a part of another object's memory until that is too
/// small.
template <class T>
struct Grown {
    std::unique_ptr<T[]> own;
    T* data = nullptr;
    std::size_t size = 0, capacity = 0;

    /// Makes room for `wanted` values in all.
    void reserve(std::size_t wanted) {
        if (wanted <= capacity) return;
        std::unique_ptr<T[]> larger(new T[wanted]);
        if (size) std::memcpy(larger.get(), data, size * sizeof(T));
        own = std::move(larger);
        data = own.get();
        capacity = wanted;
    }
    /// Makes room for `more` values beyond the present ones, which stay; grows by half the capacity more.
    void room_for(std::size_t more) {
        if (size + more > capacity) reserve(size + more + capacity / 2);
    }
    /// Uses another object's memory for `count` values, from its value `first` on; size stays.
    void borrow(const Grown& whole, std::size_t first, std::size_t count) {
        data = whole.data + first;
        capacity = count;
    }

    /// The values, whose memory must be `own`, as an array with these columns, which takes them over.
    nb::object release(std::size_t columns) {
        T* kept = own.release();
        nb::capsule owner(kept, [](void* p) noexcept { delete[] static_cast<T*>(p); });
        const std::size_t rows = size / columns;
        if (columns == 1) return nb::cast(nb::ndarray<nb::numpy, const T>(kept, {rows}, owner));
        return nb::cast(nb::ndarray<nb::numpy, const T>(kept, {rows, columns}, owner));
    }
};

/// Arc sets under construction.
struct Collected {
    static constexpr std::size_t ends = 5;     // typical number for a set: two and a half arcs
    static constexpr std::size_t columns = 9;  // of ArcColumns
    Grown<std::int64_t> count;
    Grown<double> psi, value;
    Grown<std::int8_t> joint, side, status;
    Grown<std::int64_t> pair, blocking;  // with a scene: obstacle * 256 + link, -1: none
    Grown<std::int8_t> coarse;           // with a scene: whether narrow arcs may be missing
    bool with_scene = false;

    /// Allocates memory for this number of sets.
    void reserve(std::size_t sets) {
        count.reserve(sets);
        status.reserve(sets);
        psi.reserve(ends * sets);
        value.reserve(ends * sets);
        joint.reserve(ends * sets);
        side.reserve(ends * sets);
        if (!with_scene) return;
        pair.reserve(ends * sets);
        blocking.reserve(sets);
        coarse.reserve(sets);
    }
    /// Uses the memory of another object for the sets from `first` on.
    void borrow(const Collected& whole, std::size_t first, std::size_t sets) {
        count.borrow(whole.count, first, sets);
        status.borrow(whole.status, first, sets);
        psi.borrow(whole.psi, ends * first, ends * sets);
        value.borrow(whole.value, ends * first, ends * sets);
        joint.borrow(whole.joint, ends * first, ends * sets);
        side.borrow(whole.side, ends * first, ends * sets);
        with_scene = whole.with_scene;
        if (!with_scene) return;
        pair.borrow(whole.pair, ends * first, ends * sets);
        blocking.borrow(whole.blocking, first, sets);
        coarse.borrow(whole.coarse, first, sets);
    }

    /// The number of a pair for Python: obstacle * 256 + link; -1: none.
    static std::int64_t pair_of(Tag tag) noexcept {
        return tag_obstacle(tag) < 0 ? -1 : 256 * tag_obstacle(tag) + tag_link(tag);
    }

    /// Adds a set of arcs of an S-R-S arm with its status; the ends get the joint values that cause them.
    void add(const Arm& arm, double margin, const Configuration<double>& gc, const ArcSet& set,
             Status outcome, Tag blocks_all = 0, bool narrow_left_out = false) {
        const auto value_of = [&](Tag tag, double) { return end_value(arm, margin, gc, tag); };
        add(set, outcome, value_of, blocks_all, narrow_left_out);
    }

    /// Adds a set; value_of(tag, psi) is the joint value q (rad) that causes an end.
    template <class ValueOf>
    void add(const ArcSet& set, Status outcome, const ValueOf& value_of, Tag blocks_all = 0,
             bool narrow_left_out = false) {
        count.room_for(1);
        status.room_for(1);
        count.data[count.size++] = set.count;
        status.data[status.size++] = static_cast<std::int8_t>(outcome);
        const auto ends = static_cast<std::size_t>(2 * set.count);
        psi.room_for(ends);
        value.room_for(ends);
        joint.room_for(ends);
        side.room_for(ends);
        for (int i = 0; i < set.count; ++i) {
            const Arc& arc = set.arc[i];
            psi.data[psi.size++] = arc.lower;
            psi.data[psi.size++] = arc.upper;
            for (const bool is_lower : {true, false}) {
                const Tag tag = is_lower ? arc.lower_tag : arc.upper_tag;
                joint.data[joint.size++] = static_cast<std::int8_t>(tag_joint(tag));
                side.data[side.size++] = static_cast<std::int8_t>(tag_side(tag));
                value.data[value.size++] = value_of(tag, is_lower ? arc.lower : arc.upper);
            }
        }
        if (!with_scene) return;
        blocking.room_for(1);
        blocking.data[blocking.size++] = pair_of(blocks_all);
        coarse.room_for(1);
        coarse.data[coarse.size++] = narrow_left_out ? 1 : 0;
        pair.room_for(ends);
        for (int i = 0; i < set.count; ++i)
            for (const Tag tag : {set.arc[i].lower_tag, set.arc[i].upper_tag})
                pair.data[pair.size++] = pair_of(tag);
    }

    /// Column `index` of ArcColumns as an array, from 6 on None without a scene; may be called once each.
    nb::object column(std::size_t index) {
        switch (index) {
            case 0: return count.release(1);
            case 1: return psi.release(2);
            case 2: return joint.release(2);
            case 3: return side.release(2);
            case 4: return value.release(2);
            case 5: return status.release(1);
            case 6: return with_scene ? pair.release(2) : nb::none();
            case 7: return with_scene ? blocking.release(1) : nb::none();
            default: return with_scene ? coarse.release(1) : nb::none();
        }
    }

    /// All columns as arrays.
    ArcColumns release() {
        return nb::make_tuple(column(0), column(1), column(2), column(3), column(4), column(5), column(6),
                              column(7), column(8));
    }
};

/// Puts one column of all parts, in order, into `whole`, whose memory they may have borrowed.
template <auto member>
inline void join(std::vector<Collected>& parts, Collected& whole) {
    auto& to = whole.*member;
    std::remove_reference_t<decltype(to)> all;
    std::size_t total = 0;
    bool outgrown = false;
    for (const Collected& part : parts) {
        total += (part.*member).size;
        outgrown |= (part.*member).own != nullptr;
    }
    for (Collected& part : parts) {
        auto& from = part.*member;
        if (!from.own || from.size < total) continue;
        to = std::move(from);  // one part holds everything
        return;
    }
    if (outgrown) {
        all.reserve(total);
    } else {
        all = std::move(to);
    }
    for (const Collected& part : parts) {
        const auto& from = part.*member;
        if (from.size) std::memmove(all.data + all.size, from.data, from.size * sizeof(from.data[0]));
        all.size += from.size;
    }
    to = std::move(all);
}

/// Puts the sets of all parts, in order, into `whole`, whose memory they may have borrowed.
inline void join(std::vector<Collected>& parts, Collected& whole) {
    join<&Collected::count>(parts, whole);
    join<&Collected::psi>(parts, whole);
    join<&Collected::value>(parts, whole);
    join<&Collected::joint>(parts, whole);
    join<&Collected::side>(parts, whole);
    join<&Collected::status>(parts, whole);
    if (!whole.with_scene) return;
    join<&Collected::pair>(parts, whole);
    join<&Collected::blocking>(parts, whole);
    join<&Collected::coarse>(parts, whole);
}

}  // namespace binding
