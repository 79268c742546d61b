// SPDX-License-Identifier: GPL-3.0-or-later
// Work that several experiments share is done once: values by the text of what they were made from.
#pragma once

#include <deque>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "problems/output/disk_cache.h"

namespace semblance {

// Safe from several threads: the first that asks for a key makes its value, the others wait for it.
// Keeps the `capacity` (>= 1) values that were asked for last; those in use live on without it.
class StageCache {
 public:
  // disk: for what is worth keeping between processes; may be null.
  explicit StageCache(int capacity, std::shared_ptr<const DiskCache> disk = nullptr)
      : disk_(std::move(disk)), capacity_(capacity) {}

  const DiskCache* disk() const { return disk_.get(); }

  // The value of `key`, made by make() if it is not there. What make() throws reaches all who wait,
  // and is not kept. A key stands for one type T only.
  template <class T>
  std::shared_ptr<const T> Get(const std::string& key, const std::function<T()>& make) {
    return std::static_pointer_cast<const T>(
        GetAny(key, [&make] { return std::make_shared<const T>(make()); }));
  }

  int made() const;  // how many values were made so far

 private:
  using Value = std::shared_ptr<const void>;
  Value GetAny(const std::string& key, const std::function<Value()>& make);

  std::shared_ptr<const DiskCache> disk_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_future<Value>> values_;
  std::deque<std::string> order_;  // of keys, that asked for longest ago first
  int capacity_;
  int made_ = 0;
};

}  // namespace semblance
