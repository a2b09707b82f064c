#include "libmocap/cli/tool.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <clocale>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>

#include "libmocap/base/log.hpp"
#include "libmocap/base/version.hpp"
#include "libmocap/cli/config_file.hpp"
#include "libmocap/cli/docs.hpp"
#include "libmocap/cli/option_values.hpp"
#include "libmocap/cli/report.hpp"
#include "libmocap/cli/usage_error.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/formats/motion_input.hpp"

namespace mocap::cli {
namespace {

constexpr const char* kOwn = "Options";
constexpr const char* kBatch = "Batch options";
constexpr const char* kCommon = "Common options";

// What only run() looks at.
struct Actions {
  bool print_config = false;
  std::string print_docs;
};

// A descriptor that is closed would be given to the next file opened, and log lines would land in it.
void occupy_standard_descriptors() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) != -1 || errno != EBADF) continue;
    // Opened the wrong way round, so that using it still fails, except for messages.
    const int opened = ::open("/dev/null", fd == STDOUT_FILENO ? O_RDONLY : O_WRONLY);
    if (opened != fd && opened >= 0) ::close(opened);
  }
}

std::vector<std::string> libraries() {
  std::vector<std::string> lines;
  // By symbol: a tool shows what it is linked to, and this room needs no header of either library.
  using H5Version = int (*)(unsigned*, unsigned*, unsigned*);
  if (const auto get = reinterpret_cast<H5Version>(::dlsym(RTLD_DEFAULT, "H5get_libversion"))) {
    unsigned major = 0, minor = 0, release = 0;
    get(&major, &minor, &release);
    lines.push_back(fmt::format("HDF5 {}.{}.{}", major, minor, release));
  }
  using BlasConfig = const char* (*)();
  if (const auto get = reinterpret_cast<BlasConfig>(::dlsym(RTLD_DEFAULT, "openblas_get_config")))
    lines.push_back(fmt::format("BLAS {}", get()));
  return lines;
}

std::string version_text(const Tool& tool) {
  std::string text = fmt::format("{} (mocapkit) {}\ncommit {}\n", tool.name(), version(), commit());
  for (const auto& line : libraries()) text += line + "\n";
  for (const auto& line : tool.version_lines()) text += line + "\n";
  return text;
}

void add_common_options(CLI::App& app, const Tool& tool, Common& c, Actions& actions) {
  const Traits t = tool.traits();
  const auto grouped = [](CLI::Option* option, const char* group) {
    option->group(group);
    return option;
  };
  if (t.inputs != Inputs::none) {
    std::string help = t.input_help;
    if (t.inputs == Inputs::many && help.find("@list") == std::string::npos) help += ": files, folders (searched; content decides), @list.txt (one path a line), '-' for standard input";
    app.add_option("INPUT", c.inputs, help)->configurable(false)->group("");
  }
  if (t.output != Output::none)
    grouped(app.add_option("-o,--output", c.output, t.output_help)
                ->check(path(t.output == Output::file ? "FILE" : t.output == Output::folder ? "DIR" : "DIR|FILE")), kCommon);
  if (t.output != Output::none || t.batch) grouped(app.add_flag("-f,--force", c.force, "replace existing output"), kCommon);
  if (t.random)
    grouped(app.add_option("--seed", c.seed, "of everything random; stored in the output")->check(whole(0)), kCommon);
  if (t.network)
    grouped(app.add_option("--device", c.device, "where the network runs")->check(one_of({"cpu", "cuda", "auto"})), kCommon);
  if (t.report) grouped(app.add_flag("--json", c.json, "one JSON document on standard output"), kCommon);
  if (t.threads)
    grouped(app.add_option("-j,--threads", c.threads, "worker threads; the result never depends on it")
                ->check(whole(1, 4096))->default_str("all usable cores"), kCommon);
  if (t.batch) {
    grouped(app.add_option("--rejects", c.rejects, "table of the inputs that failed: file, line, status, reason")->check(path("FILE.tsv")), kBatch);
    grouped(app.add_flag("--fail-fast", c.fail_fast, "stop at the first input that fails"), kBatch);
    grouped(app.add_option("--shard", c.shard, "only every N-th input of the sorted list, from the I-th (from 1): one task of an array job")
                ->check(path("I/N")), kBatch);
    grouped(app.add_flag("--skip-existing", c.skip_existing,
                         "do only what is missing or changed: outputs that record this command and these inputs stay"), kBatch);
  }
  grouped(app.add_flag("-v,--verbose", c.verbose, "more on standard error; twice: with detail on errors"), kCommon);
  grouped(app.add_flag("-q,--quiet", c.quiet, "only errors on standard error"), kCommon);
  grouped(app.add_option("--log-level", c.log_level, "exactly these messages on standard error")
              ->check(one_of({"debug", "info", "warning", "error"})), kCommon);
  grouped(app.add_option("--progress", c.progress, "progress line on standard error; auto: where it is a terminal")
              ->check(one_of({"auto", "always", "never"})), kCommon);
  grouped(app.set_config("--config", "", "options from a TOML or INI file; the command line goes first"), kCommon)
      ->configurable(false)->check(path("FILE"));
  grouped(app.add_flag("--print-config", actions.print_config, "write the effective options as TOML and stop"), kCommon)->configurable(false);
  app.add_option("--print-docs", actions.print_docs, "write the reference page and stop")
      ->check(one_of({"markdown", "man"}))->configurable(false)->group("");
  grouped(app.set_version_flag("--version", [&tool] { return version_text(tool); },
                               "versions of the tool and of what it is linked to"), kCommon);
  grouped(app.get_help_ptr(), kCommon);
}

void declare(CLI::App& app, Tool& tool, Common& c, Actions& actions) {
  app.set_help_flag("-h,--help", "this text");
  app.option_defaults()->always_capture_default()->group(kOwn);
  app.config_formatter(std::make_shared<ConfigFile>(tool.name()));
  app.allow_config_extras(CLI::config_extras_mode::error);
  tool.options(app);
  for (CLI::Option* option : app.get_options([](const CLI::Option*) { return true; })) {
    if (is_flag(*option)) continue;
    option->allow_extra_args(false);  // `--attr a=b INPUT`: the input is no second value
    if (is_numeric(*option) && placeholder(*option) == (type_of(*option) == "FLOAT" ? "NUMBER" : "N") && constraint(*option).empty())
      option->check(type_of(*option) == "FLOAT" ? number() : type_of(*option) == "UINT" ? whole(0) : whole());
  }
  add_common_options(app, tool, c, actions);
}

// Everything about the command line that CLI11 does not check.
void check_usage(const Tool& tool, Common& c) {
  const Traits t = tool.traits();
  if (c.quiet && c.verbose > 0) refuse_usage("--quiet and --verbose exclude each other");
  if (t.inputs != Inputs::none && c.inputs.empty()) refuse_usage("no input given, expected INPUT");
  if (t.inputs == Inputs::one && c.inputs.size() > 1)
    refuse_usage(fmt::format("{} inputs given, expected one: {}", c.inputs.size(), fmt::join(c.inputs, " ")));
  if (t.output != Output::none && t.output_required && c.output.empty()) refuse_usage("no output given, expected -o");
  if (t.output == Output::folder && c.output == "-") refuse_usage("-o -: standard output takes one file, expected a folder");
  if (!c.rejects.empty() && c.rejects == c.output) refuse_usage("--rejects and --output name the same file");
  if (c.rejects == "-") refuse_usage("--rejects -: standard output carries the result only, expected a file");
  if (!c.shard.empty()) take_shard({}, c.shard);
  if (c.device == "cuda" && !tool.has_cuda())
    refuse_usage("--device cuda: no usable CUDA device in this build or on this machine, expected cpu or auto");
  if (c.device == "auto") c.device = tool.has_cuda() ? "cuda" : "cpu";
  const Overwrite mode = c.force || c.skip_existing ? Overwrite::allow : Overwrite::refuse;
  if (t.output == Output::file && !c.output.empty() && tool.check_output_first()) check_output(c.output, mode);
  if (!c.rejects.empty()) check_output(c.rejects, mode);
}

log::Level level_of(const Common& c) {
  const std::string& l = c.log_level;
  if (!l.empty()) return l == "debug" ? log::Level::debug : l == "info" ? log::Level::info : l == "warning" ? log::Level::warning : log::Level::error;
  return c.quiet ? log::Level::error : c.verbose > 0 ? log::Level::debug : log::Level::info;
}

// The command line in CLI11's order (last first), with what it would misread put right.
std::vector<std::string> arguments(int argc, char** argv) {
  std::vector<std::string> args;
  bool options = true;
  for (int i = 1; i < argc; ++i) {
    std::string a = argv[i];
    if (a == "--") options = false;
    if (options && a.size() > 3 && a.starts_with("--") && a.find('=') == a.size() - 1) refuse_usage(a + ": an empty value");
    if (a.starts_with('[')) a = "./" + a;  // a file name, not a list of values
    args.push_back(std::move(a));
  }
  std::reverse(args.begin(), args.end());
  return args;
}

bool asks(const std::vector<std::string>& reversed, const std::string& option) {
  for (auto a = reversed.rbegin(); a != reversed.rend() && *a != "--"; ++a)
    if (*a == option || a->starts_with(option + "=")) return true;
  return false;
}

void print(const std::string& text) {
  // A failure is found by close_stdout().
  static_cast<void>(std::fwrite(text.data(), 1, text.size(), stdout));
}

// Parses and runs; throws Error.
Exit run_tool(Tool& tool, int argc, char** argv, Common& c) {
  Actions actions;
  CLI::App app{tool.synopsis(), tool.name()};
  c.threads = usable_cores();
  declare(app, tool, c, actions);
  auto args = arguments(argc, argv);
  if (asks(args, "--print-config") || asks(args, "--print-docs"))
    for (CLI::Option* option : app.get_options([](const CLI::Option*) { return true; })) option->required(false);
  try {
    app.parse(std::move(args));
  } catch (const CLI::CallForHelp&) {
    print(help_text(tool, app));
    return Exit::ok;
  } catch (const CLI::CallForVersion& version) {
    print(version.what());
    return Exit::ok;
  } catch (const CLI::ParseError& e) {
    throw usage_error(e, app, tool.name());
  } catch (const Error& e) {
    // The reader of configuration files knows the line, not the file.
    throw e.where().line > 0 && e.where().file.empty() ? e.in_file(app.get_config_ptr()->as<std::string>()) : e;
  }
  if (!actions.print_docs.empty()) {
    print(actions.print_docs == "man" ? man_page(tool, app) : markdown_page(tool, app));
    return Exit::ok;
  }
  if (actions.print_config) {
    print(effective_config(app, tool.name()));
    return Exit::ok;
  }
  log::set_level(level_of(c));
  check_usage(tool, c);
  Context context(tool, app, c);
  Exit status = Exit::ok;
  try {
    status = tool.run(context);
  } catch (...) {
    try {
      context.finish();
    } catch (const Error& also) {
      report(tool.name(), also, c.verbose);
    }
    throw;
  }
  context.finish();
  return status;
}

bool reader_is_gone() {
  pollfd out{STDOUT_FILENO, POLLOUT, 0};
  return ::poll(&out, 1, 0) == 1 && (out.revents & POLLERR) != 0;
}

// What the tool printed may still wait in the buffer, and a network file system reports a full disk only on closing.
void close_stdout() {
  const bool failed = std::fflush(stdout) != 0 || std::ferror(stdout) != 0;
  const int copy = failed ? -1 : ::dup(STDOUT_FILENO);
  if (failed || (copy >= 0 && ::close(copy) != 0)) throw Error(Exit::io, {"<stdout>", 0, {}}, std::string("write failed: ") + std::strerror(errno));
}

Exit guarded(const std::string& tool, const int& verbose, const std::function<Exit()>& body) {
  try {
    return body();
  } catch (const Error& e) {
    if (e.status() == Exit::io && e.where().file == "<stdout>" && reader_is_gone()) {
      // `tool | head`: everything is cleaned up by now; leave as other Unix tools do.
      std::signal(SIGPIPE, SIG_DFL);
      std::raise(SIGPIPE);
    }
    const bool unexplained = e.status() == Exit::usage && e.hint().empty();
    report(tool, unexplained ? Error(e.status(), e.where(), e.message(), fmt::format("try '{} --help'", tool)) : e, verbose);
    return e.status();
  } catch (const std::bad_alloc&) {
    report(tool, Error(Exit::internal, {}, "out of memory"), verbose);
  } catch (const std::exception& e) {
    report(tool, Error(Exit::internal, {}, e.what()), verbose);
  } catch (...) {
    report(tool, Error(Exit::internal, {}, "an exception of unknown type"), verbose);
  }
  return Exit::internal;
}

}  // namespace

bool Tool::accepts(const std::string& path) const {
  const formats::Probe found = formats::probe_motion(path);
  if (!found.why_not.empty()) log::info("{}: skipped: {}", path, found.why_not);
  return found.motion;
}

void report(const std::string& tool, const Error& error, int verbose) {
  const bool bug = error.status() == Exit::internal;
  fmt::print(stderr, "{}: {}{}\n", tool, bug ? "internal error: " : "", error.what());
  const std::string& hint = bug && error.hint().empty() ? "this is a bug: please report it with the command line and the input" : error.hint();
  if (!hint.empty()) fmt::print(stderr, "  hint: {}\n", hint);
  if (verbose >= 2) fmt::print(stderr, "  status: {}\n", static_cast<int>(error.status()));
}

int run(Tool& tool, int argc, char** argv) {
  occupy_standard_descriptors();
  std::setlocale(LC_NUMERIC, "C");  // a library may have set the user's while it was loaded; CLI11 converts with strtold
  std::signal(SIGPIPE, SIG_IGN);  // so that a closed pipe is an error that unwinds: temporary files are removed
  log::start(tool.name(), log::Level::info);
  Common common;
  Exit status = guarded(tool.name(), common.verbose, [&] { return run_tool(tool, argc, argv, common); });
  const Exit closed = guarded(tool.name(), common.verbose, [&] { return close_stdout(), Exit::ok; });
  if (closed != Exit::ok) status = closed;
  if (status == Exit::io) {
    // HDF5's exit handler crashes after a failed write.
    std::fflush(stderr);
    ::_exit(static_cast<int>(status));
  }
  return static_cast<int>(status);
}

}  // namespace mocap::cli
