// Restores the macros that begin.hpp hid.

#pragma pop_macro("near")
#pragma pop_macro("far")
#pragma pop_macro("small")
#pragma pop_macro("min")
#pragma pop_macro("max")
#pragma pop_macro("Status")
#pragma pop_macro("OK")

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif
