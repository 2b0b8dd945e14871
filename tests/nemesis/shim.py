"""The daemon's disk, wall clock and memory, which fail on command: shim.c, compiled once, and its orders."""
import errno
import mmap
import pathlib
import struct
import subprocess
import tempfile

SIZE = 40  # of its struct order
NOTHING, FLUSH_HANGS, MOUNT_HANGS, FLUSH_FAILS, WRITE_FAILS, CALL_FAILS = range(6)
CODES = {"EIO": errno.EIO, "ENOSPC": errno.ENOSPC, "EROFS": errno.EROFS, "EDQUOT": errno.EDQUOT}


def compiled(folder=None):
    """The shared library, built next to nothing else; its folder is the caller's to remove."""
    library = pathlib.Path(folder or tempfile.mkdtemp(prefix="nemesis.")) / "shim.so"
    source = pathlib.Path(__file__).with_name("shim.c")
    subprocess.run(["gcc", "-O1", "-fPIC", "-shared", "-o", library, source, "-ldl"], check=True)
    return library


class Shim:
    def __init__(self, library, folder, data):
        self.file = folder / "order"
        self.file.write_bytes(bytes(SIZE))
        with open(self.file, "r+b") as file:
            self.map = mmap.mmap(file.fileno(), SIZE)
        self.environment = [f"LD_PRELOAD={library}", f"NEMESIS_ORDER={self.file}",
                            f"NEMESIS_FOLDER={data}", "ASAN_OPTIONS=verify_asan_link_order=0"]

    def order(self, mode, code=0, left=-1):
        self.map[4:16] = struct.pack("=iii", code, left, 0)
        self.map[0:4] = struct.pack("=i", mode)

    def set_clock_off(self, seconds):
        self.map[16:24] = struct.pack("=d", seconds)

    def starve(self, thread, nth, for_good):
        """The nth allocation of this thread from now on fails, and all later ones if it is for good."""
        self.map[12:16] = bytes(4)
        self.map[28:36] = struct.pack("=ii", nth, for_good)
        self.map[24:28] = struct.pack("=i", thread)

    def fail_call(self, nth, for_good):
        """The nth call on the folder's files from now on fails, and all later ones if it is for good."""
        self.map[32:36] = struct.pack("=i", for_good)
        self.order(CALL_FAILS, errno.EIO, nth)

    @property
    def hits(self):
        return struct.unpack("=i", self.map[12:16])[0]

    def lift(self):
        self.order(NOTHING)
        self.map[24:28] = bytes(4)

    def close(self):
        self.map.close()
