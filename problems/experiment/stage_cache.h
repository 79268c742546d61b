// SPDX-License-Identifier: GPL-3.0-or-later
// Lets several experiments share work: values by the text of the options from which they were made.
#pragma once

#include <deque>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "problems/io/disk_cache.h"

namespace semblance::problems {

// Safe from several threads: the first one that requests a key makes its value, and the others wait
// for it. Keeps the `capacity` (>= 1) values that were requested last. Dropped values live on while
// they are in use.
class StageCache {
 public:
  // disk: for values that are worth keeping between processes; may be null.
  explicit StageCache(int capacity, std::shared_ptr<const DiskCache> disk = nullptr)
      : disk_(std::move(disk)), capacity_(capacity) {}

  const DiskCache* disk() const { return disk_.get(); }

  // The value of `key`, made by make() if it is missing. An exception of make() reaches all waiting
  // threads and is not kept. All calls with a key must have the same T.
  template <class T>
  std::shared_ptr<const T> Get(const std::string& key, const std::function<T()>& make) {
    return std::static_pointer_cast<const T>(
        GetAny(key, [&make] { return std::make_shared<const T>(make()); }));
  }

  int made() const;  // the number of values made so far

 private:
  using Value = std::shared_ptr<const void>;
  Value GetAny(const std::string& key, const std::function<Value()>& make);

  std::shared_ptr<const DiskCache> disk_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_future<Value>> values_;
  std::deque<std::string> order_;  // keys, least recently requested first
  int capacity_;
  int made_ = 0;
};

}  // namespace semblance::problems
