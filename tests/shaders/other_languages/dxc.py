"""Compiles HLSL to SPIR-V with a library of the DirectX shader compiler: dxc.py LIBRARY SOURCE OUTPUT ARGUMENTS.."""
import ctypes
import pathlib
import sys
import uuid


def guid(text):
    return ctypes.create_string_buffer(uuid.UUID(text).bytes_le, 16)


def call(this, index, *arguments, result=ctypes.c_int32):
    """Calls a COM method by its index."""
    table = ctypes.cast(ctypes.cast(this, ctypes.POINTER(ctypes.c_void_p))[0], ctypes.POINTER(ctypes.c_void_p))
    types = [type(argument) for argument in arguments]
    return ctypes.CFUNCTYPE(result, ctypes.c_void_p, *types)(table[index])(this, *arguments)


def blob_bytes(blob):
    size = call(blob, 4, result=ctypes.c_size_t)
    return ctypes.string_at(call(blob, 3, result=ctypes.c_void_p), size)


class Buffer(ctypes.Structure):
    _fields_ = [("pointer", ctypes.c_char_p), ("size", ctypes.c_size_t), ("encoding", ctypes.c_uint32)]


def main(library, source, output, *arguments):
    library = ctypes.CDLL(library)

    def create(class_id, interface):
        made = ctypes.c_void_p()
        status = library.DxcCreateInstance(guid(class_id), guid(interface), ctypes.byref(made))
        assert status == 0, hex(status & 0xFFFFFFFF)
        return made

    utils = create("6245D6AF-66E0-48FD-80B4-4D271796748C", "4605C4CB-2019-492A-ADA4-65F20BB7D67F")
    compiler = create("73E22D93-E6CE-47F3-B5BF-F0664F39C1B0", "228B4687-5A6A-4730-900C-9702B2203F54")
    includes = ctypes.c_void_p()
    call(utils, 9, ctypes.pointer(includes))
    text = pathlib.Path(source).read_bytes()
    buffer = Buffer(text, len(text), 65001)
    wide = (ctypes.c_wchar_p * (len(arguments) + 1))(source, *arguments)
    result = ctypes.c_void_p()
    interface = guid("58346CDA-DDE7-4497-9461-6F87AF5E0659")
    call(compiler, 3, ctypes.pointer(buffer), wide, ctypes.c_uint32(len(wide)), includes, interface,
         ctypes.pointer(result))
    errors, words, status = ctypes.c_void_p(), ctypes.c_void_p(), ctypes.c_int32()
    call(result, 5, ctypes.pointer(errors))
    sys.stderr.write(blob_bytes(errors).decode())
    call(result, 3, ctypes.pointer(status))
    if status.value != 0:
        sys.exit(1)
    call(result, 4, ctypes.pointer(words))
    pathlib.Path(output).write_bytes(blob_bytes(words))


main(*sys.argv[1:])
