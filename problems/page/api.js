// SPDX-License-Identifier: GPL-3.0-or-later
// Asking the program. Every address lies below the page's own, which carries the token.

async function answerOf(response) {
  const type = response.headers.get('Content-Type') || '';
  const answer = type.startsWith('application/json') ? await response.json() : await response.text();
  if (!response.ok) { throw new Error(answer.error || answer || `the program answers ${response.status}`); }
  return answer;
}

async function ask(address, options) {
  let response;
  try {
    response = await fetch(address, options);
  } catch {
    throw new Error('The program does not answer; it may have ended. Start it again: nothing is lost.');
  }
  return answerOf(response);
}

export const get = (path, query = {}) => {
  const text = new URLSearchParams(query).toString();
  return ask(`api/${path}${text ? `?${text}` : ''}`);
};

export const post = (path, body) =>
    ask(`api/${path}`, {method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify(body)});

// Several files that belong together are sent under one batch; nothing is opened by it.
export const upload = (file, batch, name) =>
    ask(`api/upload?${new URLSearchParams({batch, name})}`,
        {method: 'POST', headers: {'Content-Type': 'application/octet-stream'}, body: file});
