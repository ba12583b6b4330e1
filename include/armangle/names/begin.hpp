// Hides the macros of <windows.h>, <X11/Xlib.h> and <curses.h> that share a name with something in this
// library. end.hpp restores them.
//
// Every header with code includes this file after its last other include, and end.hpp at its bottom. Other
// libraries' headers therefore see their own macros. No #pragma once: each header needs the pair.

// The headers need C++20. MSVC reports the standard in _MSVC_LANG; g++ 10 reports 201709 for C++20.
#if defined(_MSVC_LANG) ? _MSVC_LANG <= 201703L : __cplusplus <= 201703L
// No such file exists. Unlike #error, this ends the compilation, so the message is not lost among hundreds.
#include "armangle needs C++20: compile with -std=c++20, or with /std:c++20 where the compiler is MSVC"
#endif

#pragma push_macro("near")
#undef near
#pragma push_macro("far")
#undef far
#pragma push_macro("small")
#undef small
#pragma push_macro("min")
#undef min
#pragma push_macro("max")
#undef max
#pragma push_macro("Status")
#undef Status
#pragma push_macro("OK")
#undef OK

// When a template's int is the bound of an array, g++ mistakes it for a change of sign. clang++ distinguishes
// the two, so clang++ checks sign conversions.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-conversion"
#endif
