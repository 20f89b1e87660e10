// Paths for files of tests, which run at the same time: one of this process alone.
#ifndef TESTS_SUPPORT_TEMPORARY_FILE_H
#define TESTS_SUPPORT_TEMPORARY_FILE_H

#include <filesystem>
#include <string>

#include <unistd.h>

namespace tests
{

// Where a test may write; what lies there is removed with the object.
class TemporaryFile
{
  public:
    explicit TemporaryFile(const std::string &name)
        : path_(std::filesystem::temp_directory_path() / ("pm_" + std::to_string(getpid()) + "_" + name))
    {
    }
    ~TemporaryFile()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFile(const TemporaryFile &) = delete;
    TemporaryFile &operator=(const TemporaryFile &) = delete;

    std::string path() const
    {
        return path_.string();
    }

  private:
    std::filesystem::path path_;
};

} // namespace tests

#endif
