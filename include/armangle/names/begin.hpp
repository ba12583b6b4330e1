// Hides the macros of <windows.h>, <X11/Xlib.h> and <curses.h> that are names here, until end.hpp brings them
// back.
//
// Every header with code includes this after its last other include, and end.hpp at its bottom: so no other
// library's header is read without its macros. No #pragma once, since each header needs the pair.

// The standard that the headers need. (MSVC tells it in _MSVC_LANG; g++ 10 says 201709 for C++20.)
#if defined(_MSVC_LANG) ? _MSVC_LANG <= 201703L : __cplusplus <= 201703L
// There is no such file. Unlike #error this ends the compilation, so the one line is not lost among hundreds.
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

// g++ takes an int of a template for a change of sign where it is the bound of an array. clang++ tells that
// from others, and watches those.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-conversion"
#endif
