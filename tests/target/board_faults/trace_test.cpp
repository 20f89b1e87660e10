// The image's oscilloscope over its bus of 1 Mbit/s: what was recorded is what the drive had, and it comes
// soon.
#include "bench.h"

#include <array>
#include <cstring>

#include "tests/support/bus_bits.h"

extern "C" {
#include "sim_plant/board/fdcan.h"
#include "tools/pmsim_board/bus_load.h"
}

namespace
{

using bench::Bench;

constexpr double f_pwm_Hz = 20e3;
constexpr double most_s = 2.0;
constexpr double bit_s = 1e-6;
constexpr double master_s = 1e-3; // before a master answers a block: an adapter at a serial port
constexpr size_t samples = APP_TRACE_NUMBERS / 4; // what the ring of the image holds: 45 ms and more
constexpr size_t signals = 4;
constexpr uint8_t block = 127;

using Bytes = std::vector<uint8_t>;
using Row = std::array<int16_t, signals>;

// i_d, i_q, i_c, theta: objects, and what the drive's memory has for them
constexpr uint32_t objects[signals] = {0x29000100, 0x29000200, 0x29000700, 0x29000A00};

Row row_of(const drive_t &d)
{
    return {int16_t(d.status.i.d >> 14), int16_t(d.status.i.q >> 14), int16_t(d.i_abc.c >> 14),
            int16_t(int32_t(d.status.theta) >> 16)};
}

class Scope : public Bench
{
  public:
    Scope() : Bench(config())
    {
        drive_params_t p = bench::params();
        p.f_pwm = int32_t(f_pwm_Hz);
        p.timer_counts = 4250;
        uint32_t words[STORE_WORDS];
        const uint32_t used = bus_load_page(&p, 1000, words);
        board_program(board, 0x0801F000, words, used * sizeof words[0]);
        boot();
        pass(5e-3);
        for (int n = 0; n < 10; n++) {
            command(true, DRIVE_MODE_CURRENT, 0);
            pass(0.1);
        }
        EXPECT_EQ(watched()->drive.state, DRIVE_RUNNING) << console();
        answers.clear(); // to what the command's master has set up
    }

    // One period of the carrier; `seen` grows by what the drive had in it.
    void step()
    {
        ASSERT_TRUE(board_run_period(board)) << board_error(board);
        seen.push_back(row_of(watched()->drive));
        t_s += 1.0 / f_pwm_Hz;
        board_frame_t frame;
        while (board_can_receive(board, &frame)) {
            note(frame);
            if (frame.id == 0x581) {
                answers.emplace_back(frame.data, frame.data + 8);
            }
        }
    }

    void pass(double seconds)
    {
        for (double end_s = t_s + seconds; t_s < end_s;) {
            step();
        }
    }

    void request(const Bytes &data)
    {
        board_frame_t frame = {0x601, 8, {}};
        std::copy(data.begin(), data.end(), frame.data);
        note(frame);
        ASSERT_TRUE(board_can_send(board, &frame));
    }

    Bytes answer()
    {
        for (double end_s = t_s + 0.1; answers.empty() && t_s < end_s;) {
            step();
        }
        if (answers.empty()) {
            ADD_FAILURE() << "no answer";
            return Bytes(8, 0x80);
        }
        const Bytes first = answers.front();
        answers.erase(answers.begin());
        return first;
    }

    void set(uint16_t index, uint8_t sub, uint32_t value, uint8_t size)
    {
        request({uint8_t(0x23 | (4 - size) << 2), uint8_t(index & 0xFF), uint8_t(index >> 8), sub,
                 uint8_t(value), uint8_t(value >> 8), uint8_t(value >> 16), uint8_t(value >> 24)});
        EXPECT_EQ(answer()[0], 0x60) << std::hex << index << ":" << int(sub);
    }

    uint32_t get(uint16_t index, uint8_t sub)
    {
        request({0x40, uint8_t(index & 0xFF), uint8_t(index >> 8), sub});
        uint32_t value;
        std::memcpy(&value, &answer()[4], sizeof value);
        return value;
    }

    // Block upload of 3103h, as a client of CiA 301 does it
    Bytes upload()
    {
        request({0xA4, 0x03, 0x31, 0, block, 0});
        const Bytes begin = answer();
        EXPECT_EQ(begin[0], 0xC6); // with CRC and size
        uint32_t size;
        std::memcpy(&size, &begin[4], sizeof size);
        request({0xA3});
        Bytes data;
        for (bool last = false; !last && !HasFailure();) {
            const Bytes segment = answer();
            last = (segment[0] & 0x80) != 0;
            data.insert(data.end(), segment.begin() + 1, segment.end());
            if (last || (segment[0] & 0x7F) == block) {
                pass(master_s);
                request({0xA2, uint8_t(segment[0] & 0x7F), block});
            }
        }
        EXPECT_EQ(answer()[0] & 0xE3, 0xC1);
        request({0xA1});
        data.resize(size);
        return data;
    }

    double t_s = 0.0;
    double stuffed_s = 0.0; // more, had all frames been stuffed at their worst
    std::vector<Row> seen;

  private:
    static bool HasFailure()
    {
        return testing::Test::HasFailure();
    }

    static plant_config_t config()
    {
        plant_config_t c = bench::plant_config();
        c.inverter.f_pwm_Hz = f_pwm_Hz;
        c.inverter.timer_counts = 4250;
        return c;
    }

    void note(const board_frame_t &frame)
    {
        fdcan_frame_t out = {};
        out.id = frame.id;
        out.length = frame.length;
        std::copy(frame.data, frame.data + 8, out.data);
        stuffed_s += bit_s * (bus_bits::most(frame.length) - int(fdcan_frame_bits(&out)));
    }

    std::vector<Bytes> answers;
};

TEST(BoardTrace, FourSignalsAt20kHzAreWholeAlignedAndSoonThere)
{
    Scope x;
    for (uint8_t n = 0; n < signals; n++) {
        x.set(0x3101, uint8_t(n + 1), objects[n], 4);
    }
    x.seen.clear();
    x.set(0x3100, 1, 1, 1); // arm, triggered at once
    x.command(true, DRIVE_MODE_CURRENT, 0);
    while ((x.get(0x3100, 2) & 0xFF) != TRACE_COMPLETE && x.seen.size() < 4 * samples) {
        x.pass(5e-3);
    }
    ASSERT_EQ(x.get(0x3100, 8), samples);

    x.command(true, DRIVE_MODE_CURRENT, 0);
    const double began_s = x.t_s;
    x.stuffed_s = 0.0;
    const Bytes bytes = x.upload();
    const double took_s = x.t_s - began_s;
    const double worst_s = took_s + x.stuffed_s;
    std::printf("uploaded %zu bytes in %.3f s at 1 Mbit/s; %.3f s were each frame stuffed at its worst\n",
                bytes.size(), took_s, worst_s);
    RecordProperty("upload_ms", int(1e3 * worst_s));
    EXPECT_LT(worst_s, most_s);

    ASSERT_EQ(bytes.size(), 2 * signals * samples);
    std::vector<Row> got(samples);
    std::memcpy(got.data(), bytes.data(), bytes.size());
    std::vector<size_t> places;
    for (size_t at = 0; at + samples <= x.seen.size(); at++) {
        if (std::equal(got.begin(), got.end(), x.seen.begin() + long(at))) {
            places.push_back(at);
        }
    }
    EXPECT_EQ(places.size(), 1U) << "periods that could be those of the recording, all four signals";
    EXPECT_NE(got.front()[3], got[samples / 2][3]); // the rotor turned
}

} // namespace
