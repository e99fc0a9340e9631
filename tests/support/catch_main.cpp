// SPDX-License-Identifier: MIT
// Catch2 2 is a header: its implementation and main are compiled here, once. Catch2 3 brings both as a library.
#if !__has_include(<catch2/catch_all.hpp>)
#  define CATCH_CONFIG_MAIN
#endif
#include <support/catch.hpp>
