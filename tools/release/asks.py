"""What a program or a library asks of its system, read from the file itself: the libraries that it loads, and how old the system may be."""
import pathlib
import re
import struct
import subprocess
import tempfile

from .running import Failed

# Mach-O's load commands that say so.
DYLIB, WEAK_DYLIB, SIGNATURE, OLDEST, BUILT_FOR = 0xC, 0x80000018, 0x1D, 0x24, 0x32
MACHO, UNIVERSAL = b"\xcf\xfa\xed\xfe", b"\xca\xfe\xba\xbe"


def of(text: bytes) -> str:
    """One phrase. Failed where it is the file of no system that is known here."""
    if text[:4] == UNIVERSAL:
        count, = struct.unpack_from(">I", text, 4)
        slices = [struct.unpack_from(">5I", text, 8 + 20 * i) for i in range(count)]
        return "; ".join(dict.fromkeys(_macho(text[at:at + size]) for _, _, at, size, _ in slices))
    if text[:4] == MACHO:
        return _macho(text)
    if text[:4] == b"\x7fELF":
        told = _told(text, "readelf", "-d", "-V", "-W")
        asked = re.findall(r"\(NEEDED\).*\[(.+)\]", told)
        glibc = max((tuple(map(int, each.split("."))) for each in re.findall(r"Name: GLIBC_([\d.]+)", told)), default=())
        return (", ".join(asked) + (f" (glibc {'.'.join(map(str, glibc))})" if glibc else "")) or "nothing"
    if text[:2] == b"MZ":
        return ", ".join(sorted(set(re.findall(r"DLL Name: (\S+)", _told(text, "objdump", "-p"))), key=str.lower)) or "nothing"
    raise Failed(f"no program of a known system: it begins with {text[:4]!r}")


def _macho(text: bytes) -> str:
    count, = struct.unpack_from("<I", text, 16)
    at, asked, oldest, signed = 32, [], "", False
    for _ in range(count):
        command, size = struct.unpack_from("<2I", text, at)
        if command in (DYLIB, WEAK_DYLIB):
            start, = struct.unpack_from("<I", text, at + 8)
            asked.append(text[at + start:at + size].split(b"\0")[0].decode())
        elif command in (OLDEST, BUILT_FOR):
            number, = struct.unpack_from("<I", text, at + (8 if command == OLDEST else 12))
            oldest = f"macOS {number >> 16}.{number >> 8 & 255}"
        signed = signed or command == SIGNATURE
        at += size
    return ", ".join(asked) + f" ({oldest}, {'signed by the linker' if signed else 'no signature'})"


def _told(text: bytes, *command: str) -> str:
    with tempfile.NamedTemporaryFile() as file:
        pathlib.Path(file.name).write_bytes(text)
        return subprocess.run([*command, file.name], capture_output=True, text=True, check=True).stdout
