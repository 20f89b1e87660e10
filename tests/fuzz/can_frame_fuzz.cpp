// Frames of any kind to node, drive profile and trace, with time, loads of the bus and faults in between.
// Input: records of one operation byte and what it needs; the first byte of all chooses the node id.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tests/fuzz/exercise.h"

extern "C" {
#include "firmware/can/cia402.h"
#include "firmware/can/node.h"
#include "firmware/can/node_state.h"
#include "firmware/can/trace.h"
}

namespace
{

// Ends with zeros.
class Input
{
  public:
    Input(const uint8_t *data, size_t size) : data_(data), left_(size)
    {
    }

    bool empty() const
    {
        return left_ == 0;
    }

    uint8_t byte()
    {
        if (left_ == 0) {
            return 0;
        }
        --left_;
        return *data_++;
    }

    uint16_t word()
    {
        const uint8_t low = byte();
        return uint16_t(low | byte() << 8);
    }

  private:
    const uint8_t *data_;
    size_t left_;
};

// Says at the end of a run how much it was.
struct Frames {
    unsigned long long count = 0;

    ~Frames()
    {
        std::fprintf(stderr, "stat::frames:                   %llu\n", count);
    }
};

Frames frames;

void demand(bool holds)
{
    if (!holds) {
        std::abort();
    }
}

struct Device {
    node_t node;
    cia402_t profile;
    cia402_in_t facts;
    trace_t trace;
    int16_t ring[64];
    int32_t sources[8];
    int32_t parameters[OD_PARAMETER_COUNT];
    uint8_t node_id;
    bool on, bus_full, store_fails;
    uint32_t now_us, sent, written;
};

Device &device_of(void *context)
{
    return *static_cast<Device *>(context);
}

bool send(void *context, const node_frame_t *frame)
{
    Device &d = device_of(context);
    demand(frame->length <= 8 && frame->id < 0x800);
    d.sent += d.bus_full ? 0 : 1;
    return !d.bus_full;
}

bool on(void *context)
{
    return device_of(context).on || cia402_on(&device_of(context).profile);
}

int32_t get(void *context, const od_entry_t *entry)
{
    Device &d = device_of(context);
    int32_t value = 0;
    if (entry->kind == OD_PARAMETER) {
        demand(entry->slot < OD_PARAMETER_COUNT);
        return d.parameters[entry->slot];
    }
    demand(entry->slot < OD_LIVE_COUNT);
    if (entry->slot == OD_LIVE_STATUSWORD) {
        return cia402_statusword(&d.profile, &d.facts);
    }
    if (!cia402_get(&d.profile, entry->slot, &value) && !trace_get(&d.trace, entry->slot, &value)) {
        value = int32_t(d.now_us >> 12);
    }
    return value;
}

uint32_t put(void *context, const od_entry_t *entry, int32_t value)
{
    Device &d = device_of(context);
    uint32_t code = SDO_UNSUPPORTED;
    if ((entry->flags & OD_RANGE) != 0) { // the node promises it
        const bool is_signed = entry->type <= OD_I32;
        demand(is_signed ? value >= od_values_of(entry).least && value <= od_values_of(entry).most
                         : uint32_t(value) >= uint32_t(od_values_of(entry).least) &&
                               uint32_t(value) <= uint32_t(od_values_of(entry).most));
    }
    demand((entry->flags & OD_WRITE) != 0);
    demand((entry->flags & OD_ONLY_OFF) == 0 || !on(context));
    if (entry->kind == OD_PARAMETER) {
        demand(entry->slot < OD_PARAMETER_COUNT);
        d.parameters[entry->slot] = value;
        return 0;
    }
    if (!cia402_put(&d.profile, entry->slot, value, &code)) {
        trace_put(&d.trace, entry->slot, value, &code);
    }
    return code;
}

bool find(void *context, uint16_t index, uint8_t sub, trace_signal_t *signal)
{
    Device &d = device_of(context);
    if (index != 0x2900 || sub == 0 || sub > 8) {
        return false;
    }
    *signal = {&d.sources[sub - 1], sub % 2 == 0 ? 32768 : 1, sub > 6};
    return true;
}

uint32_t size_of(void *context, const od_entry_t *entry)
{
    return entry->slot == OD_LIVE_TRACE_DATA ? trace_size(&device_of(context).trace) : 9;
}

void read(void *context, const od_entry_t *entry, uint32_t offset, uint8_t *bytes, uint32_t count)
{
    Device &d = device_of(context);
    demand(count <= 7);
    if (entry->slot != OD_LIVE_TRACE_DATA) {
        demand(offset + count <= 9);
        std::memset(bytes, 'x', count);
    } else if (d.trace.end != nullptr) { // settings may have changed since the transfer began
        trace_read(&d.trace, offset, bytes, count);
    }
}

uint32_t write(void *context, const od_entry_t *, uint32_t, const uint8_t *bytes, uint32_t count, bool)
{
    for (uint32_t n = 0; n < count; ++n) {
        device_of(context).written += bytes[n];
    }
    return 0;
}

uint32_t store(void *context, uint32_t group)
{
    demand(group <= NODE_GROUP_LSS && !on(context));
    return device_of(context).store_fails ? SDO_HARDWARE : 0;
}

void recall(void *context)
{
    Device &d = device_of(context);
    bool has;
    node_recall(&d.node, od_find(0x2080, 1, &has), d.node_id);
}

void alarm(void *context, uint16_t code)
{
    demand(code != 0);
    device_of(context).facts.fault = true;
}

void reset(void *)
{
}

void give(Device &d, uint16_t id, uint8_t length, Input &input)
{
    node_frame_t frame = {id, length, {}};
    for (uint8_t n = 0; n < length && n < 8; ++n) {
        frame.data[n] = input.byte();
    }
    node_receive(&d.node, &frame, d.now_us);
    ++frames.count;
}

void step(Device &d)
{
    const cia402_out_t out = cia402_step(&d.profile, &d.facts);
    demand(!out.enable || (!d.facts.fault && cia402_on(&d.profile)));
    demand(!(out.enable && out.coast));
    if (out.clear_fault) {
        demand(d.facts.fault && d.facts.off);
        d.facts.fault = false;
    }
}

void operate(Device &d, Input &input)
{
    const uint8_t operation = input.byte();
    const uint16_t id = d.node.id;
    switch (operation % 12) {
    case 0:
    case 1:
    case 2:
    case 3:
        give(d, uint16_t(0x600 + id), 8, input);
        break;
    case 4:
        give(d, uint16_t(0x200 + 0x100 * (operation / 12 % 4) + id), uint8_t(operation / 48 + 4), input);
        break;
    case 5:
        give(d, uint16_t(input.word() % 0x800), uint8_t(operation / 12 % 10), input); // 9: no such length
        break;
    case 6:
        give(d, 0x000, 2, input);
        break;
    case 7:
        give(d, 0x7E5, 8, input);
        break;
    case 8:
        for (uint32_t left = input.word(); left > 0; left -= left < 1000 ? left : 1000) {
            d.now_us += left < 1000 ? left : 1000;
            node_run(&d.node, d.now_us);
        }
        break;
    case 9: {
        const uint8_t bits = input.byte();
        d.on = (bits & 1) != 0;
        d.bus_full = (bits & 2) != 0;
        d.store_fails = (bits & 4) != 0;
        d.facts = {
            (bits & 8) != 0, (bits & 16) != 0, (bits & 32) != 0, (bits & 64) != 0, true, false, false, bits};
        node_bus(&d.node, node_bus_t(operation / 12 % 3));
        break;
    }
    case 10:
        node_error(&d.node, node_error_t(operation / 12 % NODE_ERRORS), input.word(), operation);
        break;
    default:
        for (int n = input.byte(); n >= 0; --n) {
            d.sources[n % 8] = n * 7919;
            trace_sample(&d.trace);
        }
        break;
    }
    step(d);
    demand(d.node.ring_count <= NODE_RING && d.node.emcy_count <= NODE_EMCY);
    demand(d.node.sdo.held_count <= 7 && d.node.sdo.block <= 127);
    if (d.trace.next == nullptr) { // it was never armed
        demand(d.trace.countdown == 0);
    } else {
        demand(d.trace.next >= d.ring && d.trace.next < d.ring + sizeof d.ring / sizeof d.ring[0]);
    }
}

} // namespace

extern "C" {
bool trace_host_find(void *context, uint16_t index, uint8_t sub, trace_signal_t *signal)
{
    return find(context, index, sub, signal);
}

bool node_host_send(void *context, const node_frame_t *frame)
{
    return send(context, frame);
}

bool node_host_on(void *context)
{
    return on(context);
}

int32_t node_host_get(void *context, const od_entry_t *entry)
{
    return get(context, entry);
}

uint32_t node_host_put(void *context, const od_entry_t *entry, int32_t value)
{
    return put(context, entry, value);
}

uint32_t node_host_size(void *context, const od_entry_t *entry)
{
    return size_of(context, entry);
}

void node_host_read(void *context, const od_entry_t *entry, uint32_t offset, uint8_t bytes[], uint32_t count)
{
    read(context, entry, offset, bytes, count);
}

uint32_t node_host_write(void *context, const od_entry_t *entry, uint32_t offset, const uint8_t bytes[],
                         uint32_t count, bool last)
{
    return write(context, entry, offset, bytes, count, last);
}

uint32_t node_host_store(void *context, uint32_t group)
{
    return store(context, group);
}

uint32_t node_host_restore(void *context, uint32_t group)
{
    return store(context, group);
}

void node_host_recall(void *context)
{
    recall(context);
}

void node_host_alarm(void *context, uint16_t code)
{
    alarm(context, code);
}

void node_host_reset(void *context)
{
    reset(context);
}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static Device d;
    Input input(data, size);
    std::memset(&d, 0, sizeof d);
    const uint8_t id = input.byte() % 129;
    d.node_id = id == 0 || id == 128 ? 255 : id;
    d.facts.ready = true;
    d.facts.off = true;
    cia402_init(&d.profile);
    trace_init(&d.trace, d.ring, sizeof d.ring / sizeof d.ring[0], &d);
    node_init(&d.node, &d, 0x12345678, 0);
    while (!input.empty()) {
        operate(d, input);
    }
    // whatever has come: after a reset it is a node again, that answers
    d.bus_full = false;
    d.on = false;
    const node_frame_t reset_all = {0, 2, {130, 0}};
    node_receive(&d.node, &reset_all, d.now_us);
    node_run(&d.node, d.now_us);
    if (d.node.nmt != NODE_INITIALISING) {
        const uint32_t before = d.sent;
        const node_frame_t ask = {uint16_t(0x600 + d.node.id), 8, {0x40, 0x00, 0x10}};
        node_receive(&d.node, &ask, d.now_us);
        demand(d.sent == before + 1);
    }
    return 0;
}
