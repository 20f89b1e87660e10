"""DBC: default process data, heartbeat and emergency message of a node with the default id."""
from .model import TYPES

NMT = {0: "boot-up", 4: "stopped", 5: "operational", 127: "pre-operational"}


def _signal(name, start, bits, text, signed=False, factor="1", unit="", limits=None, values=None):
    least, most = limits or ((-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1))
    scale = float(factor)
    return {"name": name, "start": start, "bits": bits, "signed": signed, "factor": factor, "unit": unit, "help": text,
            "least": f"{least * scale:.10g}", "most": f"{most * scale:.10g}", "values": values}


def _pdo(pdo, node_id):
    signals, start = [], 0
    for entry in pdo.entries:
        factor = f"{entry.factor:.17g}" if entry.exp2 else f"{entry.factor:.9g}"
        limits = None if entry.least is None else (entry.least, entry.most)
        unit = "" if entry.unit == "1" else entry.unit
        signals.append(_signal(entry.name.replace(".", "_"), start, entry.bits, entry.help,
                               TYPES[entry.type][2] < 0, factor, unit, limits, entry.values))
        start += entry.bits
    name = f"{'RPDO' if pdo.direction == 'receive' else 'TPDO'}{pdo.number}"
    state = "" if pdo.enabled else ", not in use until it is enabled"
    return {"id": pdo.cob_id + node_id, "name": name, "bytes": start // 8, "signals": signals,
            "sender": "MASTER" if pdo.direction == "receive" else "DRIVE",
            "help": f"{pdo.direction} process data {pdo.number}{state}"}


def messages(dictionary):
    node_id = dictionary.device["default_node_id"]
    out = [_pdo(pdo, node_id) for pdo in dictionary.pdos if pdo.entries]
    codes = {fault.code: fault.text for fault in dictionary.faults}
    codes.update({code: text for code, text in dictionary.errors.items() if code not in codes})
    out.append({"id": 0x80 + node_id, "name": "EMCY", "bytes": 8, "sender": "DRIVE", "help": "emergency message",
                "signals": [_signal("emcy_error_code", 0, 16, "error code", values=dict(sorted(codes.items()))),
                            _signal("emcy_error_register", 16, 8, dictionary.named("error_register").help)]})
    out.append({"id": 0x700 + node_id, "name": "HEARTBEAT", "bytes": 1, "sender": "DRIVE", "help": "heartbeat",
                "signals": [_signal("nmt_state", 0, 7, "state of the network management", values=NMT)]})
    return sorted(out, key=lambda m: m["id"])
