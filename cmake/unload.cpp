// A part of every shared library that zig links for Linux. GCC's start files do this in each library, zig's do not:
// what a library has registered for the end of the program (destructors of its statics) is done when it is unloaded,
// since its code is not there any more at the end.
extern "C" {
extern __attribute__((visibility("hidden"))) void* __dso_handle;  // the linker's; its address is the library's name
void __cxa_finalize(void* library);
}

namespace {
__attribute__((destructor)) void Unload() {
  __cxa_finalize(&__dso_handle);
}
}  // namespace
