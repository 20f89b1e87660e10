#include "tools/pmsim_board/gdb_server.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tools/pmsim_board/gdb_link.h"

/* r0 to r15 and xPSR, as the target description has them */
enum { REGISTERS = 17 };
#define FIRST_RAM UINT32_C(0x10000000) /* below it is flash, which no debugger writes like that */

struct gdb_server {
    cpu_t *cpu;
    gdb_link_t link;
    bool running;     /* the client waits for a stop */
    bool interrupted; /* it has asked for it */
};

static const char description[] =
    "<?xml version=\"1.0\"?><!DOCTYPE target SYSTEM "
    "\"gdb-target.dtd\"><target><architecture>arm</architecture>"
    "<feature name=\"org.gnu.gdb.arm.m-profile\">"
    "<reg name=\"r0\" bitsize=\"32\"/><reg name=\"r1\" bitsize=\"32\"/><reg name=\"r2\" bitsize=\"32\"/>"
    "<reg name=\"r3\" bitsize=\"32\"/><reg name=\"r4\" bitsize=\"32\"/><reg name=\"r5\" bitsize=\"32\"/>"
    "<reg name=\"r6\" bitsize=\"32\"/><reg name=\"r7\" bitsize=\"32\"/><reg name=\"r8\" bitsize=\"32\"/>"
    "<reg name=\"r9\" bitsize=\"32\"/><reg name=\"r10\" bitsize=\"32\"/><reg name=\"r11\" bitsize=\"32\"/>"
    "<reg name=\"r12\" bitsize=\"32\"/><reg name=\"sp\" bitsize=\"32\" type=\"data_ptr\"/>"
    "<reg name=\"lr\" bitsize=\"32\"/><reg name=\"pc\" bitsize=\"32\" type=\"code_ptr\"/>"
    "<reg name=\"xpsr\" bitsize=\"32\"/></feature></target>";

/* Numbers of the protocol are hexadecimal. Moves `at` behind the number and what separates it. */
static uint32_t number(const char **at)
{
    char *end;
    const unsigned long value = strtoul(*at, &end, 16);
    *at = *end != '\0' ? end + 1 : end;
    return (uint32_t)value;
}

static void put_byte(char **text, uint8_t byte)
{
    *text += sprintf(*text, "%02x", byte);
}

static void put_word(char **text, uint32_t word)
{
    for (int n = 0; n < 4; n++) {
        put_byte(text, (uint8_t)(word >> (8 * n)));
    }
}

/* False: no more bytes. */
static bool take_byte(const char **at, uint8_t *byte)
{
    const char digits[3] = {(*at)[0], (*at)[0] != '\0' ? (*at)[1] : '\0', '\0'};
    char *end;
    *byte = (uint8_t)strtoul(digits, &end, 16);
    const bool taken = end == &digits[2];
    *at += taken ? 2 : 0;
    return taken;
}

static bool take_word(const char **at, uint32_t *word)
{
    uint8_t byte = 0;
    bool taken = true;
    *word = 0;
    for (int n = 0; n < 4; n++) {
        taken = taken && take_byte(at, &byte);
        *word |= (uint32_t)byte << (8 * n);
    }
    return taken;
}

static const char *read_memory(const gdb_server_t *server, const char *at, char *reply)
{
    const uint32_t address = number(&at);
    const uint32_t count = number(&at);
    char *text = reply;
    for (uint32_t n = 0; n < count && n < GDB_PACKET / 2 - 1; n++) {
        const uint8_t *byte = cpu_memory(server->cpu, address + n, 1);
        if (byte == NULL) {
            break;
        }
        put_byte(&text, *byte);
    }
    return text > reply || count == 0 ? reply : "E01";
}

static const char *write_memory(const gdb_server_t *server, const char *at)
{
    const uint32_t address = number(&at);
    const uint32_t count = number(&at);
    uint8_t *memory = address >= FIRST_RAM ? cpu_memory(server->cpu, address, count) : NULL;
    if (memory == NULL) {
        return "E01";
    }
    for (uint32_t n = 0; n < count; n++) {
        if (!take_byte(&at, &memory[n])) {
            return "E02";
        }
    }
    cpu_code_changed(server->cpu, address, count);
    return "OK";
}

static const char *read_registers(const gdb_server_t *server, int first, int count, char *reply)
{
    char *text = reply;
    for (int n = first; n < first + count; n++) {
        put_word(&text, cpu_register(server->cpu, n));
    }
    return reply;
}

static const char *write_registers(const gdb_server_t *server, const char *at, int first, int count)
{
    for (int n = first; n < first + count; n++) {
        uint32_t word;
        if (!take_word(&at, &word)) {
            return "E02";
        }
        cpu_set_register(server->cpu, n, word);
    }
    return "OK";
}

static const char *one_register(const gdb_server_t *server, const char *at, bool write, char *reply)
{
    const uint32_t n = number(&at);
    if (n >= REGISTERS) {
        return "E01";
    }
    return write ? write_registers(server, at, (int)n, 1) : read_registers(server, (int)n, 1, reply);
}

/* Z0 and Z1 are the same here. */
static const char *put_break(const gdb_server_t *server, const char *packet)
{
    if (packet[1] != '0' && packet[1] != '1') {
        return "";
    }
    const char *at = &packet[3];
    return cpu_break(server->cpu, number(&at), packet[0] == 'Z') ? "OK" : "E03";
}

static const char *describe(const char *at, char *reply)
{
    const uint32_t offset = number(&at);
    const uint32_t most = number(&at);
    const uint32_t size = sizeof description - 1;
    const uint32_t left = offset < size ? size - offset : 0;
    const uint32_t count = left < most ? left : most;
    (void)sprintf(reply, "%c%.*s", count < left ? 'm' : 'l', (int)count, &description[size - left]);
    return reply;
}

static const char *query(const char *packet, char *reply)
{
    static const char features[] = "qXfer:features:read:target.xml:";
    if (strncmp(packet, "qSupported", 10) == 0) {
        return "PacketSize=800;qXfer:features:read+;vContSupported+";
    }
    if (strncmp(packet, features, sizeof features - 1) == 0) {
        return describe(&packet[sizeof features - 1], reply);
    }
    return strncmp(packet, "qAttached", 9) == 0 ? "1" : "";
}

static const char *answer(const gdb_server_t *server, const char *packet, char *reply)
{
    switch (packet[0]) {
    case '?':
        return "S05";
    case 'g':
        return read_registers(server, 0, REGISTERS, reply);
    case 'G':
        return write_registers(server, &packet[1], 0, REGISTERS);
    case 'p':
    case 'P':
        return one_register(server, &packet[1], packet[0] == 'P', reply);
    case 'm':
        return read_memory(server, &packet[1], reply);
    case 'M':
        return write_memory(server, &packet[1]);
    case 'z':
    case 'Z':
        return put_break(server, packet);
    case 'H':
    case 'T':
        return "OK"; /* there is one thread */
    case 'q':
        return query(packet, reply);
    case 'v':
        return strcmp(packet, "vCont?") == 0 ? "vCont;c;C;s;S" : "";
    default:
        return "";
    }
}

static void leave(gdb_server_t *server)
{
    gdb_link_close(&server->link);
    cpu_debug(server->cpu, NULL, NULL);
}

/* c, s, vCont;c..., vCont;s...: without vCont gdb would step by breaks of its own. False: none of them. */
static bool asks_to_run(const char *packet, cpu_debug_t *how)
{
    const char *verb = strncmp(packet, "vCont;", 6) == 0 ? &packet[6] : packet;
    const bool steps = *verb == 's' || (verb != packet && *verb == 'S');
    *how = steps ? CPU_STEP : CPU_GO;
    return steps || *verb == 'c' || (verb != packet && *verb == 'C');
}

static cpu_debug_t stop(void *owner)
{
    gdb_server_t *server = owner;
    char packet[GDB_PACKET], reply[GDB_PACKET];
    if (server->running) {
        gdb_link_send(&server->link, server->interrupted ? "S02" : "S05");
    }
    server->running = server->interrupted = false;
    while (gdb_link_receive(&server->link, packet)) {
        cpu_debug_t how;
        if (asks_to_run(packet, &how)) {
            server->running = true;
            return how;
        }
        switch (packet[0]) {
        case 'D':
            gdb_link_send(&server->link, "OK");
            leave(server);
            return CPU_GO;
        case 'k':
            exit(0);
        case '\x03':
            break;
        default:
            gdb_link_send(&server->link, answer(server, packet, reply));
            break;
        }
    }
    leave(server);
    return CPU_GO;
}

static void tell(uint16_t port)
{
    (void)fprintf(stderr, "pmsim board: waits for gdb: target remote localhost:%u\n", (unsigned)port);
}

gdb_server_t *gdb_server_attach(cpu_t *cpu, uint16_t port)
{
    gdb_server_t *server = calloc(1, sizeof *server);
    if (server == NULL) {
        return NULL;
    }
    server->cpu = cpu;
    if (!gdb_link_open(&server->link, port, tell)) {
        free(server);
        return NULL;
    }
    cpu_debug(cpu, server, stop);
    cpu_ask_debugger(cpu);
    return server;
}

void gdb_server_poll(gdb_server_t *server)
{
    if (server->running && server->link.connection >= 0 && gdb_link_interrupted(&server->link)) {
        server->interrupted = true;
        cpu_ask_debugger(server->cpu);
    }
}

void gdb_server_detach(gdb_server_t *server)
{
    if (server != NULL) {
        if (server->running) {
            gdb_link_send(&server->link, "W00");
        }
        leave(server);
        free(server);
    }
}
