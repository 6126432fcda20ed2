// Loads a plug-in in a process that has nothing of shellwarp, and looks where its library came from. Arguments: the plug-in, the
// folder that the library must be in, the stand-in's own library, which a host has loaded before.
#include <dlfcn.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

int main(int argc, char **argv) {
  if (argc != 4 || !dlopen(argv[3], RTLD_NOW | RTLD_GLOBAL)) return EXIT_FAILURE;
  void *plugin = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
  if (!plugin) {
    printf("%s\n", dlerror());
    return EXIT_FAILURE;
  }
  Dl_info from{};
  void *entry = dlsym(plugin, "sw_version_string");  // of what the plug-in needs
  if (!entry || !dladdr(entry, &from) || std::strncmp(from.dli_fname, argv[2], std::strlen(argv[2])) != 0) {
    printf("the library is %s, not in %s\n", from.dli_fname ? from.dli_fname : "not there", argv[2]);
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
