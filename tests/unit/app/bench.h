// The application on the simulated board, with a master on its bus.
#ifndef TESTS_UNIT_APP_BENCH_H
#define TESTS_UNIT_APP_BENCH_H

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/application.h"
#include "tests/support/plants.h"

namespace app_test
{

const uint32_t signature_open = 0x6E65706F;

class Bench
{
  public:
    Bench() : plant_(make(), &plant_destroy)
    {
        sim_hal_init(&loop.hal, plant_.get());
    }

    // As from power-on, with these parameters in flash or none
    void boot(const drive_params_t *params)
    {
        if (params != nullptr) {
            ASSERT_TRUE(app_save(&loop.hal, params));
        }
        sim_loop_boot(&loop);
    }

    void give(uint16_t id, const std::vector<uint8_t> &data)
    {
        hal_can_frame_t frame = {id, uint8_t(data.size()), {}};
        std::copy(data.begin(), data.end(), frame.data);
        ASSERT_TRUE(sim_queue_put(&loop.hal.received, &frame));
    }

    // The default process data: controlword, mode, target velocity
    void control(uint16_t word, int8_t mode = 3, int32_t mrad_s = 30000)
    {
        const auto v = uint32_t(mrad_s);
        give(0x201, {uint8_t(word & 0xFF), uint8_t(word >> 8), uint8_t(mode), uint8_t(v), uint8_t(v >> 8),
                     uint8_t(v >> 16), uint8_t(v >> 24)});
    }

    void send(bool enable, bool clear = false)
    {
        give(0, {1, 0}); // NMT start
        if (enable) {
            control(0x06);
            control(0x07);
            control(0x0F);
        } else {
            control(clear ? 0x80 : 0x07);
        }
    }

    void run_ms(int ms)
    {
        for (int k = 0; k < 10 * ms; ++k) {
            sim_loop_step(&loop);
        }
    }

    // Commanded again and again, as a master does
    void run_enabled_ms(int ms)
    {
        send(true);
        for (int done = 0; done < ms; done += 100) {
            run_ms(std::min(100, ms - done));
            control(0x0F);
        }
    }

    // Frames of one identifier among those that were sent; all are gone then
    std::vector<hal_can_frame_t> take(uint16_t id)
    {
        std::vector<hal_can_frame_t> found;
        hal_can_frame_t frame;
        while (sim_queue_take(&loop.hal.sent, &frame)) {
            if (frame.id == id) {
                found.push_back(frame);
            }
        }
        return found;
    }

    // Expedited, with the abort code if there is one
    uint32_t sdo(const std::vector<uint8_t> &request, uint32_t *value = nullptr)
    {
        take(0);
        give(0x601, request);
        for (int ms = 0; ms < 5; ++ms) {
            run_ms(1);
            for (const hal_can_frame_t &reply : take(0x581)) {
                uint32_t word;
                std::memcpy(&word, &reply.data[4], 4);
                if (value != nullptr) {
                    *value = word;
                }
                return reply.data[0] == 0x80 ? word : 0;
            }
        }
        ADD_FAILURE() << "no reply";
        return 1;
    }

    // What is locked is opened first.
    uint32_t set(uint16_t index, uint8_t sub, uint32_t value)
    {
        bool has;
        const od_entry_t *entry = od_find(index, sub, &has);
        if (entry->locked != 0 && loop.app.node.word[OD_NODE_PARAMETERS_OPEN] == 0) {
            EXPECT_EQ(set(0x2010, 5, signature_open), 0U);
        }
        return set_as_it_is(index, sub, value);
    }

    // Without a key
    uint32_t set_as_it_is(uint16_t index, uint8_t sub, uint32_t value)
    {
        bool has;
        const uint32_t size = od_size(od_find(index, sub, &has));
        return sdo({uint8_t(0x23 | (4 - size) << 2), uint8_t(index & 0xFF), uint8_t(index >> 8), sub,
                    uint8_t(value), uint8_t(value >> 8), uint8_t(value >> 16), uint8_t(value >> 24)});
    }

    uint32_t get(uint16_t index, uint8_t sub = 0)
    {
        uint32_t value = 0;
        EXPECT_EQ(sdo({0x40, uint8_t(index & 0xFF), uint8_t(index >> 8), sub, 0, 0, 0, 0}, &value), 0U)
            << std::hex << index;
        return value;
    }

    // Where a parameter of the drive is in the dictionary; those of the schematic are neither written nor stored
    static const od_entry_t *entry_of(drive_param_id_t id)
    {
        for (uint32_t row = 0; row < od_count; ++row) {
            if (od_table[row].kind == OD_PARAMETER && od_table[row].slot == id &&
                ((od_table[row].flags & OD_STORED) != 0 || (od_table[row].flags & OD_WRITE) == 0)) {
                return &od_table[row];
            }
        }
        ADD_FAILURE() << id;
        return nullptr;
    }

    static bool is_stored(drive_param_id_t id)
    {
        return (entry_of(id)->flags & OD_STORED) != 0;
    }

    static uint32_t stored_parameters()
    {
        uint32_t count = 0;
        for (int id = 0; id < DRIVE_PARAM_COUNT; ++id) {
            count += is_stored(drive_param_id_t(id)) ? 1 : 0;
        }
        return count;
    }

    uint32_t set(drive_param_id_t id, int32_t value)
    {
        return set(entry_of(id)->index, entry_of(id)->sub, uint32_t(value));
    }

    int32_t parameter(drive_param_id_t id)
    {
        return int32_t(get(entry_of(id)->index, entry_of(id)->sub));
    }

    uint16_t statusword()
    {
        return uint16_t(get(0x6041) & 0xFFFF);
    }

    drive_fault_t fault() const
    {
        return loop.app.drive.fault;
    }

    std::string console() const
    {
        return loop.hal.console;
    }

    plant_t *plant() const
    {
        return plant_.get();
    }

    sim_loop_t loop = {};

  private:
    static plant_t *make()
    {
        plant_config_t c = plants::ipm_1000();
        c.inverter.timer_counts = 8500;
        const char *error = nullptr;
        return plant_create(&c, 1.0, &error);
    }

    std::unique_ptr<plant_t, void (*)(plant_t *)> plant_;
};

inline drive_params_t defaults()
{
    drive_params_t params;
    drive_params_default(&params);
    return params;
}

// A drive that runs at 30 rad/s, held by its RPDO
class Running : public Bench
{
  public:
    Running()
    {
        const drive_params_t params = defaults();
        boot(&params);
        run_enabled_ms(700);
        EXPECT_EQ(loop.app.drive.state, DRIVE_RUNNING);
    }
};

} // namespace app_test

#endif
