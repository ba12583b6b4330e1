// XLA's interface for external functions, version 0.1: the layout of the data that a handler reads and
// writes.
//
// Layout, numbers and their meaning are those of OpenXLA's xla/ffi/api/c_api.h; newer XLA accepts version
// 0.1. Only the parts used by xla.cpp are declared, and assertions check the relevant offsets.
#pragma once

#include <cstddef>
#include <cstdint>

namespace binding::xla {

inline constexpr int major_version = 0;
inline constexpr int minor_version = 1;

/// One of a chain of queries that XLA adds to a struct.
struct Extension {
    std::size_t size;
    std::int32_t kind;
    Extension* next;
};

inline constexpr std::int32_t asks_metadata = 1;  // the kind of MetadataQuestion

/// The beginning of every struct of the interface: its size in bytes, then its extensions.
struct Head {
    std::size_t size;
    Extension* extensions;
};

struct Version {
    Head head;
    std::int32_t major, minor;
};

struct Metadata {
    std::size_t size;
    Version version;
    std::uint32_t traits;
};

struct MetadataQuestion {
    Extension extension;
    Metadata* answer;
};

struct Error;  // XLA's own

enum class ErrorCode : std::int32_t { invalid_argument = 3, not_found = 5 };

struct NewError {
    Head head;
    const char* message;
    ErrorCode code;
};

/// The size that XLA expects of a NewError: up to its last member, without padding at the end.
inline constexpr std::size_t new_error_size = offsetof(NewError, code) + sizeof(ErrorCode);

/// Functions that a handler may call; more follow.
struct Api {
    Head head;
    Version version;
    void* internal;
    Error* (*make_error)(NewError*);
};

enum class Number : std::int32_t { float32 = 11, float64 = 12 };

struct Buffer {
    Head head;
    Number number;
    void* data;
    std::int64_t rank;
    std::int64_t* extents;
};

/// A number that is fixed when a function is compiled.
struct Scalar {
    Number number;
    void* value;
};

struct Name {
    const char* text;
    std::size_t length;
};

/// Arguments or results: all of ours are Buffers.
struct Operands {
    Head head;
    std::int64_t count;
    std::int32_t* kinds;
    void** items;
};

struct Attributes {
    Head head;
    std::int64_t count;
    std::int32_t* kinds;
    Name** names;
    void** items;
};

enum class Stage : std::int32_t { instantiate = 0, prepare = 1, initialize = 2, execute = 3 };

struct Call {
    Head head;
    const Api* api;
    void* context;
    Stage stage;
    Operands arguments, results;
    Attributes attributes;
};

using Handler = Error*(Call*);

static_assert(sizeof(void*) != 8 || (offsetof(Api, make_error) == 48 && offsetof(Metadata, traits) == 32));
static_assert(sizeof(void*) != 8 || (offsetof(Call, arguments) == 40 && offsetof(Call, attributes) == 120));

}  // namespace binding::xla
