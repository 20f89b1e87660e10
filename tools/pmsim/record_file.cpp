#include "tools/pmsim/record_file.h"

#include <algorithm>
#include <fstream>

#include "firmware/params/parameters.h"
#include "tools/pmsim/input_files.h"
#include "tools/pmsim/loop.h"
#include "tools/pmsim/rig.h"

namespace pmsim
{
namespace
{

// Bytes in the order of the file, whatever the host's.
class Bytes
{
  public:
    template <class T> void put(T value)
    {
        const auto bits = static_cast<std::make_unsigned_t<T>>(value);
        for (size_t i = 0; i < sizeof(T); ++i) {
            text_ += static_cast<char>((bits >> (8 * i)) & 0xffU);
        }
    }

    void put_magic()
    {
        text_ += RECORD_MAGIC;
    }

    const std::string &text() const
    {
        return text_;
    }

  private:
    std::string text_;
};

void put_period(Bytes &bytes, const record_period_t &period)
{
    for (const uint16_t code : period.i_leg) {
        bytes.put(code);
    }
    bytes.put(period.v_dc);
    for (const uint8_t byte : {period.hw_fault, period.given, period.enable, period.mode}) {
        bytes.put(byte);
    }
    for (const int32_t word : {period.speed_mrad_s, period.torque_uNm, period.current_mA, period.duty_ppm,
                               period.temperature_dC}) {
        bytes.put(word);
    }
    for (const auto &leg : period.compare) {
        bytes.put(leg[0]);
        bytes.put(leg[1]);
    }
    for (const uint8_t driven : period.driven) {
        bytes.put(driven);
    }
    bytes.put(period.unused);
}

} // namespace

static_assert(sizeof(record_period_t) == 48 && sizeof(record_header_t) == 24 + 4 * RECORD_LAYOUT,
              "record.h must have no holes");

Recording record_scenario(const Scenario &scenario, uint64_t most_periods)
{
    Recording recording;
    recording.params = scenario.setup.params;
    Loop loop(scenario);
    recording.slow_divider = loop.slow_divider();
    const uint64_t count = std::min(most_periods, period_count(scenario));
    recording.periods.reserve(count);
    for (uint64_t k = 0; k < count; ++k) {
        loop.step();
        recording.periods.push_back(loop.record());
    }
    return recording;
}

void write_recording(const Recording &recording, const std::string &path)
{
    Bytes bytes;
    bytes.put_magic();
    bytes.put(static_cast<uint32_t>(DRIVE_PARAM_COUNT));
    bytes.put(static_cast<uint32_t>(recording.periods.size()));
    bytes.put(recording.slow_divider);
    bytes.put(static_cast<uint32_t>(sizeof(record_period_t)));
    uint32_t layout[RECORD_LAYOUT];
    rig_layout(layout);
    for (const uint32_t word : layout) {
        bytes.put(word);
    }
    for (int id = 0; id < DRIVE_PARAM_COUNT; ++id) {
        bytes.put(drive_param_get(recording.params.get(), static_cast<drive_param_id_t>(id)));
    }
    for (const record_period_t &period : recording.periods) {
        put_period(bytes, period);
    }
    refuse_input_as_output(path);
    std::ofstream file(path, std::ios::binary);
    file << bytes.text();
    if (!file.flush()) {
        throw InputError(path + ": cannot be written");
    }
}

} // namespace pmsim
