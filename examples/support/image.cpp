// SPDX-License-Identifier: MIT
// The one place where stb's functions are compiled.
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb_image_write.h>
