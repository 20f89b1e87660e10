"""pmsim board --gdb: with gdb itself where it is installed, and with a client of a few lines for what gdb does not show.

usage: gdb_test.py PMSIM IMAGE SCENARIO
"""
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

PMSIM = IMAGE = SCENARIO = None
GDB = next((path for name in ("gdb-multiarch", "arm-none-eabi-gdb") if (path := shutil.which(name))), None)
CCM_END = 0x10002700  # behind what the image keeps in CCM SRAM


class Board:
    """A run that waits for a client."""

    def __init__(self):
        self.process = subprocess.Popen([PMSIM, "board", IMAGE, SCENARIO, "--similar", "--gdb", "0"], text=True,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        line = self.process.stderr.readline()
        self.port = int(re.search(r"localhost:(\d+)", line)[1])

    def kill(self):
        self.process.kill()
        self.process.communicate()

    def end(self):
        out, error = self.process.communicate(timeout=60)
        return self.process.returncode, out, error


class Client:
    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60)

    def send(self, text):
        self.socket.sendall(f"${text}#{sum(text.encode()) & 255:02x}".encode())

    def receive(self):
        data = b""
        while not re.search(rb"\$([^#]*)#..", data):
            part = self.socket.recv(4096)
            if not part:
                raise EOFError
            data += part
        self.socket.sendall(b"+")
        return re.search(rb"\$([^#]*)#..", data)[1].decode()

    def ask(self, text):
        self.send(text)
        return self.receive()

    def register(self, n):
        return int.from_bytes(bytes.fromhex(self.ask(f"p{n:x}")), "little")


class Protocol(unittest.TestCase):
    def setUp(self):
        self.board = Board()
        self.addCleanup(self.board.kill)
        self.client = Client(self.board.port)
        self.addCleanup(self.client.socket.close)

    def test_ctrl_c_stops_and_the_run_goes_on(self):
        self.assertEqual(self.client.ask("?"), "S05")
        for _ in range(3):
            self.client.send("c")
            self.client.socket.sendall(b"\x03")
            self.assertEqual(self.client.receive(), "S02")
        self.assertEqual(self.client.ask("c"), "W00")
        code, out, _ = self.board.end()
        self.assertEqual(code, 0, out)
        self.assertRegex(out, r"drive's memory the same as on the host after \d{4,} interrupts")

    def test_detach_and_loss_let_it_run(self):
        self.assertEqual(self.client.ask("D"), "OK")
        self.assertEqual(self.board.end()[0], 0)
        other = Board()
        self.addCleanup(other.kill)
        Client(other.port).socket.close()
        self.assertEqual(other.end()[0], 0)

    def test_memory_and_registers(self):
        self.assertEqual(self.client.ask(f"M{CCM_END:x},4:78563412"), "OK")
        self.assertEqual(self.client.ask(f"m{CCM_END:x},4"), "78563412")
        self.assertEqual(self.client.ask("P3=efbeadde"), "OK")
        self.assertEqual(self.client.register(3), 0xDEADBEEF)
        every = bytes.fromhex(self.client.ask("g"))
        self.assertEqual(len(every), 17 * 4)
        self.assertEqual(every[12:16], bytes.fromhex("efbeadde"))
        self.assertEqual(self.client.register(16), 0x01000000, "thumb, thread mode")
        self.assertEqual(self.client.ask("M8000000,1:00"), "E01", "flash is not written like that")
        self.assertEqual(self.client.ask("m40012c00,4"), "E01", "registers of devices are not memory")

    def test_what_it_does_not_know_it_says(self):
        self.assertEqual(self.client.ask("vMustReplyEmpty"), "")
        self.assertEqual(self.client.ask("Z2,20000000,4"), "")
        self.assertEqual(self.client.ask("p11"), "E01")
        self.client.socket.sendall(b"$g#00")  # wrong sum: asked for again
        self.assertEqual(self.client.socket.recv(1), b"-")
        self.assertEqual(len(self.client.ask("g")), 17 * 8)


@unittest.skipUnless(GDB, "no gdb for this processor is installed")
class Gdb(unittest.TestCase):
    def run_gdb(self, *commands):
        board = Board()
        self.addCleanup(board.kill)
        words = ["-batch", "-nx", "-ex", "set pagination off", "-ex", f"target remote localhost:{board.port}"]
        for command in commands:
            words += ["-ex", command]
        result = subprocess.run([GDB, *words, IMAGE], capture_output=True, text=True, timeout=120)
        return result.stdout + result.stderr, board

    def test_break_in_main_and_in_the_control_interrupt(self):
        text, board = self.run_gdb(
            "info symbol $pc", "break main", "continue", "info symbol $pc", "delete", "break port_control",
            "continue", "ignore 2 9", "print app_instance.drive.period", "continue", "print app_instance.drive.period",
            "print $xpsr & 0x1ff", "delete", "detach")
        self.assertIn("port_reset in section", text)
        self.assertRegex(text, r"Breakpoint 1, .*main")
        self.assertRegex(text, r"Breakpoint 2, .*port_control")
        first, second = map(int, re.findall(r"\$[12] = (\d+)", text))
        self.assertEqual(second - first, 10)
        self.assertIn("$3 = 34", text)  # 16 + interrupt 18
        code, out, error = board.end()
        self.assertEqual(code, 0, out + error)
        self.assertIn("drive's memory the same as on the host", out)

    def test_steps_follow_the_code(self):
        script = ("python\n"
                  "arch = gdb.selected_frame().architecture()\n"
                  "at = int(gdb.parse_and_eval('(unsigned)$pc'))\n"
                  "for n in range(300):\n"
                  "    insn = arch.disassemble(at)[0]\n"
                  "    gdb.execute('stepi', to_string=True)\n"
                  "    now = int(gdb.parse_and_eval('(unsigned)$pc'))\n"
                  "    print('STEP %x %d %x %s' % (at, insn['length'], now, insn['asm'].replace(chr(9), ' ')))\n"
                  "    at = now\n"
                  "end\n")
        with tempfile.NamedTemporaryFile("w", suffix=".gdb") as file:
            file.write(script)
            file.flush()
            text, _ = self.run_gdb("break port_control", "continue", "delete", f"source {file.name}", "kill")
        steps = re.findall(r"STEP (\w+) (\d) (\w+) (.*)", text)
        self.assertEqual(len(steps), 300, text)
        taken = 0
        for at, length, now, asm in steps:
            if int(now, 16) == int(at, 16) + int(length):
                continue
            taken += 1
            self.assertRegex(asm, r"^(b|cb|tb|it|pop.*pc|ldm.*pc|ldr.*pc)", f"{at} -> {now}: {asm}")
        self.assertGreater(taken, 5)
        self.assertLess(taken, 150)


if __name__ == "__main__":
    PMSIM, IMAGE, SCENARIO = sys.argv[1:4]
    unittest.main(argv=sys.argv[:1])
