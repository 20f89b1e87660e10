#include "tools/pmsim/input_files.h"

#include <filesystem>
#include <mutex>
#include <set>

#include "tools/pmsim/yaml_reader.h"

namespace pmsim
{
namespace
{

struct InputFiles {
    std::mutex mutex;
    std::set<std::string> paths;
};

InputFiles &input_files()
{
    static InputFiles files;
    return files;
}

} // namespace

void note_input(const std::string &path)
{
    InputFiles &files = input_files();
    const std::lock_guard<std::mutex> lock(files.mutex);
    files.paths.insert(path);
}

void refuse_input_as_output(const std::string &path)
{
    InputFiles &files = input_files();
    const std::lock_guard<std::mutex> lock(files.mutex);
    for (const std::string &input : files.paths) {
        std::error_code none; // one that does not exist is no other file
        if (std::filesystem::equivalent(path, input, none)) {
            throw InputError(path + ": would overwrite an input" + (path == input ? "" : ", " + input));
        }
    }
}

} // namespace pmsim
