"""pmsim node as its user meets it, over serial-line CAN on a pseudo-terminal: time, end, errors.

usage: node_command_test.py PMSIM
"""

import pathlib
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "support"))
from node_bus import SCENARIO, Master, Node, Remote, SerialBus  # noqa: E402

PMSIM = sys.argv[1]
DRIFT_S = 1e-3
BEAT_S = 0.02  # so many that some of them are in time on a busy computer


def summary(node):
    """Simulated, latest and lost seconds from the last line."""
    found = node.wait_for(r"^([0-9.]+) s, at most ([0-9.]+) ms late(?:, ([0-9.]+) s lost)?; ")
    return float(found.group(1)), 1e-3 * float(found.group(2)), float(found.group(3) or 0.0)


def stop(node, number=signal.SIGINT):
    assert node.stop(number) == 0, node.text()
    return summary(node)


def beats(bus, seconds):
    """Arrival of each heartbeat in that time."""
    arrivals, end_s = [], time.monotonic() + seconds
    while time.monotonic() < end_s:
        frame = bus.receive(0.5)
        if frame and Remote.is_beat(frame):
            arrivals.append(time.monotonic())
    return arrivals


def drift(arrivals, period_s):
    """Of that period against the clock. Each may be late; the earliest of many tells."""
    offsets = [arrival - n * period_s for n, arrival in enumerate(arrivals)]
    fifth = len(offsets) // 5
    return min(offsets[-fifth:]) - min(offsets[:fifth])


def simulated_time_keeps_up_with_the_clock():
    """The heartbeat, made quick, comes every 20 ms of the drive's time: over 5 s no drift but what the node reports as
    lost, of which some may have been lost when nobody listened yet."""
    node = Node(PMSIM, "slcan:")
    bus = SerialBus(node.where)
    bus.send(*Remote.heartbeat(BEAT_S))
    beats(bus, 2 * Remote.PERIOD_S)
    arrivals = beats(bus, 5.0)
    _, latest_s, lost_s = stop(node)
    drift_s = drift(arrivals, BEAT_S)
    print(f"      {len(arrivals)} beats, drift {1e3 * drift_s:.3f} ms, latest {1e3 * latest_s:.1f} ms, "
          f"lost {1e3 * lost_s:.0f} ms")
    assert -DRIFT_S < drift_s < DRIFT_S + lost_s, drift_s


def lateness_is_reported():
    node = Node(PMSIM, "slcan:")
    node.time_of("off$")
    node.process.send_signal(signal.SIGSTOP)
    time.sleep(0.7)
    node.process.send_signal(signal.SIGCONT)
    lost = node.wait_for(r"pmsim node: at .* s: ([0-9.]+) s behind real time, going on from here")
    assert float(lost.group(1)) > 0.5, lost.group(0)
    _, latest_s, lost_s = stop(node)
    assert lost_s > 0.5 and latest_s > 0.5


def is_caught_up():
    node = Node(PMSIM, "slcan:")
    node.time_of("off$")
    node.process.send_signal(signal.SIGSTOP)
    time.sleep(0.12)
    node.process.send_signal(signal.SIGCONT)
    time.sleep(0.5)
    simulated_s, latest_s, lost_s = stop(node)
    assert latest_s > 0.1
    return simulated_s + lost_s > 0.55


def a_short_pause_is_caught_up():
    """Simulated time is that of the wall again, unless another program takes the processor just then: not three times."""
    assert any(is_caught_up() for _ in range(3))


def duration_ends_it():
    began = time.monotonic()
    result = subprocess.run([PMSIM, "node", SCENARIO, "--can", "slcan:", "--duration", "0.5"], capture_output=True,
                            text=True, check=False, timeout=60)
    assert result.returncode == 0, result
    assert time.monotonic() - began > 0.45
    assert result.stdout.splitlines()[-1].startswith("0.500 s, "), result.stdout
    quiet = subprocess.run([PMSIM, "node", SCENARIO, "--can", "slcan:", "--duration", "0.1", "--quiet"],
                           capture_output=True, text=True, check=False, timeout=60)
    assert len(quiet.stdout.splitlines()) == 1 and quiet.stdout.startswith("node on /dev/pts/"), quiet


def a_signal_ends_it():
    for number in (signal.SIGINT, signal.SIGTERM):
        node = Node(PMSIM, "slcan:")
        node.time_of("off$")
        began = time.monotonic()
        stop(node, number)
        assert time.monotonic() - began < 5.0


def a_pwm_period_that_does_not_divide_the_slice():
    """At 15.5 kHz a slice is a whole number of periods all the same: simulated time is that of the wall."""
    options = [word for name, value in (("inverter.f_pwm_Hz", 15500), ("inverter.timer_counts", 5484))
               for word in ("--set", f"{name}={value}")]
    start_s = time.monotonic()
    node = Node(PMSIM, "slcan:", *options)
    started_s = time.monotonic()
    time.sleep(3.0)
    passed_s = time.monotonic() - started_s
    simulated_s, _, lost_s = stop(node)
    assert passed_s - 0.03 < simulated_s + lost_s < time.monotonic() - start_s, (passed_s, simulated_s, lost_s)


def it_drives():
    node = Node(PMSIM, "slcan:")
    master = Master(SerialBus(node.where))
    master.say(True, 50.0)
    master.wait_for("running")
    master.silent = True
    master.wait_for("fault")
    node.time_of("fault REMOTE_LOST")
    master.silent = False
    master.clear()
    master.close()
    stop(node)


def bad_input_is_refused():
    def expect(words, *arguments):
        result = subprocess.run([PMSIM, "node", *arguments], capture_output=True, text=True, check=False, timeout=60)
        assert result.returncode == 2 and words in result.stderr, result

    expect("--can", SCENARIO)
    expect("required", "--can", "slcan:")
    expect("no_such.yaml", "no_such.yaml", "--can", "slcan:")
    expect("nocan7", SCENARIO, "--can", "nocan7")
    expect("HOST:PORT", SCENARIO, "--can", "socketcand:29536")
    expect("/dev/no_such", SCENARIO, "--can", "slcan:/dev/no_such")
    expect("CHIP:OFFSET", SCENARIO, "--can", "slcan:", "--gpio-enable", "gpiochip0")
    expect("no_such_chip", SCENARIO, "--can", "slcan:", "--gpio-fault", "no_such_chip:1")
    expect("duration", SCENARIO, "--can", "slcan:", "--duration", "-1")
    expect("no_such", SCENARIO, "--can", "slcan:", "--set", "no_such=1")


def main():
    for test in (bad_input_is_refused, duration_ends_it, a_signal_ends_it, it_drives, lateness_is_reported,
                 a_short_pause_is_caught_up, a_pwm_period_that_does_not_divide_the_slice,
                 simulated_time_keeps_up_with_the_clock):
        began = time.monotonic()
        test()
        print(f"PASS  {test.__name__}, {time.monotonic() - began:.1f} s", flush=True)


main()
