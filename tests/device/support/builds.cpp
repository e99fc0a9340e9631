// SPDX-License-Identifier: MIT
#include <device/support/builds.hpp>

#include <dlfcn.h>

#include <sstream>
#include <stdexcept>

namespace patchrt::test {

entry_point build::kernel(std::string const& kernel_name) const {
  void* const symbol = dlsym(library, kernel_name.c_str());
  if (symbol == nullptr) throw std::runtime_error(name + " has no kernel " + kernel_name);
  return reinterpret_cast<entry_point>(symbol);
}

std::vector<build> builds_of(std::string const& program) {
  std::vector<build> builds;
  std::istringstream names(PATCHRT_DEVICE_BUILDS);
  for (std::string name; names >> name;) {
    std::string const path = std::string(PATCHRT_DEVICE_LIBRARIES) + "/" + program + "." + name + ".so";
    // Local: every library exports the same names. Libraries stay loaded; opening one again gives the same handle.
    void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr) throw std::runtime_error(dlerror());
    builds.push_back({name, name.starts_with("sm_"), library});
  }
  return builds;
}

}  // namespace patchrt::test
