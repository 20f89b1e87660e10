// Commands and their options on the command line, in the words of CLI11, which does the work. Only command_line.cpp
// includes it: it takes five to ten seconds to compile, more than all that the commands themselves include.
//
//   Command *command = app.add_subcommand("run", "Run a scenario");
//   command->add_option("scenario", options->scenario, "scenario file (YAML)")->required();
//   command->callback([options] { run(*options); });
//
// Variables and callbacks are used when the line is parsed: they must live until then. Options and commands belong to
// the CommandLine.
#ifndef PMSIM_COMMAND_LINE_H
#define PMSIM_COMMAND_LINE_H

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI
{
class App;
class Option;
} // namespace CLI

namespace pmsim
{

class Option
{
  public:
    explicit Option(CLI::Option *cli_option) : option(cli_option)
    {
    }

    Option *required(bool value = true);
    Option *one_each();     // of a list: one value for each time the option stands there
    Option *show_default(); // in the help, as the variable is now
    Option *positive();     // refuses other numbers
    Option *range(int low, int high);
    Option *words(const std::map<std::string, int> &values); // of an int: words for numbers
    Option *needs(const Option *other);
    Option *excludes(const std::string &name);

    bool empty() const; // not on the line; after parsing

  private:
    CLI::Option *option;
};

class Command
{
  public:
    explicit Command(std::shared_ptr<CLI::App> cli_app);
    Command(const Command &) = delete;
    Command &operator=(const Command &) = delete;

    Command *add_subcommand(const std::string &name, const std::string &description);

    // "--name", or "name" for one without dashes, at its place
    Option *add_option(const std::string &name, std::string &variable, const std::string &help);
    Option *add_option(const std::string &name, std::vector<std::string> &variable, const std::string &help);
    Option *add_option(const std::string &name, int &variable, const std::string &help);
    Option *add_option(const std::string &name, uint64_t &variable, const std::string &help);
    Option *add_option(const std::string &name, double &variable, const std::string &help);
    Option *add_flag(const std::string &name, bool &variable, const std::string &help);
    Option *get_option(const std::string &name);

    void footer(const std::string &text); // of the help
    void callback(const std::function<void()> &run);
    // All words after the command's name, unread, also --help.
    void pass_words(const std::function<void(const std::vector<std::string> &)> &run);

  protected:
    std::shared_ptr<CLI::App> app;

  private:
    Option *own(CLI::Option *cli_option);

    std::vector<std::unique_ptr<Option>> options;
    std::vector<std::unique_ptr<Command>> commands;
};

class CommandLine : public Command
{
  public:
    explicit CommandLine(const std::string &description);

    void name(const std::string &text);
    void require_subcommand();

    // Reads the words and runs the callback of the command. An exit code where the program is to end now: help was
    // wanted, or the words are wrong (2), which has been said. Throws InputError of a word that is no command.
    std::optional<int> parse(int argc, char **argv);

  private:
    void refuse_unknown_command() const;
};

// The exit code, or 2, which is then said, where standard output did not take all that was printed.
int finish(int exit_code);

} // namespace pmsim

#endif
