"""cmake/unload.cpp: a library that is linked without GCC's start files, as zig links them, may be unloaded before its program ends."""
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIBRARY = """
struct Said {
  ~Said() { count = left; }
  int left = 3;
  static int count;
};
int Said::count;
Said said;
extern "C" int Ask() { return said.left; }
"""
PROGRAM = """
#include <dlfcn.h>
int main(int, char** arguments) {
  void* library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return 2;
  if (reinterpret_cast<int (*)()>(dlsym(library, "Ask"))() != 3) return 3;
  return dlclose(library);
}
"""
# What the linker that zig brings defines by itself, and GCC's start files for others.
NAME = 'extern "C" __attribute__((visibility("hidden"))) void* __dso_handle; void* __dso_handle = &__dso_handle;'


def compiled(folder, name, text, *arguments):
    (folder / f"{name}.cpp").write_text(text)
    subprocess.run(["c++", *arguments, folder / f"{name}.cpp", "-o", folder / name, "-ldl"], check=True)
    return folder / name


def test_a_library_without_gccs_start_files_is_unloaded_before_the_end(tmp_path):
    program = compiled(tmp_path, "program", PROGRAM)
    bare = compiled(tmp_path, "bare.so", LIBRARY + NAME, "-shared", "-fPIC", "-nostartfiles")
    whole = compiled(tmp_path, "whole.so", LIBRARY + NAME, "-shared", "-fPIC", "-nostartfiles", ROOT / "cmake/unload.cpp")
    assert subprocess.run([program, bare]).returncode < 0  # what is called at the end is not there any more
    assert subprocess.run([program, whole]).returncode == 0
