#include "tools/pmsim/machine_file.h"

namespace pmsim
{

Setup read_machine(const Value &value)
{
    std::vector<std::string> known = setup_sections();
    known.emplace_back("name");
    const Map map(value, known);
    Setup setup = default_setup();
    setup.name = map.at("name").text();
    read_sections(setup, map, true);
    return setup;
}

Setup load_machine_file(const std::string &path)
{
    return read_machine(Value::from_file(path));
}

} // namespace pmsim
