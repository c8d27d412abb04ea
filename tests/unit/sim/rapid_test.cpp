// RAPID: what parses, what it does, and what it refuses.
#include "fixture.hpp"
#include "sim/rapid_memory.hpp"

namespace weldcell::sim {

TEST(RapidLiteral, PrintsWhatItReads) {
  for (const char* text :
       {"1", "-2.5", "TRUE", "\"say \"\"hi\"\"\"", "[[1,2,3],[0.5,FALSE,\"x\"]]", "9E+09"}) {
    const auto value = rapid::parse_literal(text);
    ASSERT_TRUE(value) << text;
    EXPECT_EQ(rapid::print(*value), text);
  }
  for (const char* text : {"", "[1,2", "1 2", "\"open", "nan", "[,]", "maybe"}) {
    EXPECT_FALSE(rapid::parse_literal(text)) << text;
  }
}

TEST(RapidModule, FaultNamesItsLine) {
  rapid::Memory memory;
  const auto line_of = [&](const std::string& text) { return memory.load(text, true).error().text(); };
  EXPECT_NE(line_of("MODULE M\n  VAR num a:=1\n  VAR num b:=2;\nENDMODULE").find("line 3"),
            std::string::npos);
  EXPECT_NE(line_of("MODULE M\n VAR nonsense a;\nENDMODULE").find("unknown type 'nonsense'"),
            std::string::npos);
  EXPECT_NE(line_of("MODULE M\n PROC p()\n  WHILE TRUE DO\n ENDPROC\nENDMODULE").find("endwhile expected"),
            std::string::npos);
  EXPECT_NE(line_of("MODULE M\n CONST robtarget p:=[[1,2,3],[1,0,0,0]];\nENDMODULE").find("line 2"),
            std::string::npos);
  EXPECT_NE(line_of("MODULE M\nENDMODULE rubbish").find("text after ENDMODULE"), std::string::npos);
  EXPECT_TRUE(memory.load("%%%\n VERSION:1\n%%%\nMODULE M\nENDMODULE", false));
  EXPECT_FALSE(memory.load("MODULE M\nENDMODULE", false));
  EXPECT_TRUE(memory.load("MODULE M\nENDMODULE", true));
}

TEST(RapidProgram, RunsStatements) {
  Bench bench;
  bench.run_program(R"(MODULE T
  PERS num nSum:=0;
  PERS num nLoops:=0;
  PERS string sWord:="";
  PERS bool bFlag:=FALSE;
  PERS num nCase:=0;
  VAR num a{3}:=[1,2,3];
  PERS jointtarget jNow:=[[0,0,0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC add(num x)
    nSum:=nSum+x;
  ENDPROC
  PROC main()
    VAR num local:=4;
    FOR i FROM 1 TO 3 DO
      add a{i}*2;
    ENDFOR
    WHILE nLoops<5 DO
      INCR nLoops;
      IF nLoops=2 THEN
        sWord:=sWord+"two";
      ELSEIF nLoops=3 THEN
        sWord:=sWord+"three";
      ELSE
        sWord:=sWord+"x";
      ENDIF
    ENDWHILE
    TEST nLoops
    CASE 1,2:
      nCase:=1;
    CASE 4,5:
      nCase:=2;
    DEFAULT:
      nCase:=3;
    ENDTEST
    IF nSum=12 AND NOT bFlag bFlag:=TRUE;
    jNow.robax.rax_2:=local+7 MOD 4;
    jNow.extax.eax_a:=-1.5;
    %"add"% 100;
  ENDPROC
ENDMODULE)",
                    "T", "main");
  ASSERT_TRUE(bench.finish(2)) << bench.last_events();
  EXPECT_EQ(bench.value("T", "nSum"), "112");
  EXPECT_EQ(bench.value("T", "sWord"), "\\\"xtwothreexx\\\"");
  EXPECT_EQ(bench.value("T", "nCase"), "2");
  EXPECT_EQ(bench.value("T", "bFlag"), "TRUE");
  EXPECT_EQ(bench.value("T", "jNow"), "[[0,7,0,0,0,0],[-1.5,9E+09,9E+09,9E+09,9E+09,9E+09]]");
}

TEST(RapidProgram, ErrorHandlersRetryGoOnAndReturn) {
  Bench bench;
  bench.run_program(R"(MODULE T
  PERS num nZero:=0;
  PERS num nTries:=0;
  PERS num nDone:=0;
  PROC deep()
    nDone:=1/nZero;
  ENDPROC
  PROC main()
    deep;
    nDone:=nDone+10;
  ERROR
    IF ERRNO=ERR_DIVZERO THEN
      INCR nTries;
      IF nTries<3 RETRY;
      IF nTries=3 THEN
        nZero:=4;
        RETRY;
      ENDIF
    ENDIF
  ENDPROC
ENDMODULE)",
                    "T", "main");
  ASSERT_TRUE(bench.finish(2));
  EXPECT_EQ(bench.value("T", "nTries"), "3");
  EXPECT_EQ(bench.value("T", "nDone"), "10.25");
}

TEST(RapidProgram, UnhandledErrorStopsAndSaysWhere) {
  Bench bench;
  bench.run_program("MODULE T\nPROC main()\n  VAR num n:=0;\n  n:=1/n;\nENDPROC\nENDMODULE", "T", "main");
  ASSERT_TRUE(bench.finish(1));
  const Event& last = bench.controller.events().back();
  EXPECT_EQ(last.type, 3);
  EXPECT_NE(last.text.find("T/main line 4"), std::string::npos) << last.text;
}

TEST(RapidProgram, WaitTimeIsProgramTime) {
  Bench bench;
  bench.run_program("MODULE T\nPERS num n:=0;\nPROC main()\n WaitTime 0.5;\n n:=1;\nENDPROC\nENDMODULE", "T",
                    "main");
  bench.step(100);
  EXPECT_EQ(bench.value("T", "n"), "0");
  EXPECT_EQ(bench.rws("POST", "/rw/rapid/execution?action=stop", "stopmode=stop").status, 204);
  bench.step(200);
  EXPECT_EQ(bench.value("T", "n"), "0");
  EXPECT_EQ(bench.rws("POST", "/rw/rapid/execution?action=start", Bench::kStart).status, 204);
  bench.step(30);
  EXPECT_EQ(bench.value("T", "n"), "1");
}

TEST(RapidProgram, TrapRunsWhileAnInstructionWaitsWhichThenGoesOn) {
  Bench bench;
  bench.run_program(R"(MODULE T
  PERS bool bAsk:=FALSE;
  PERS num nTraps:=0;
  PERS num n:=0;
  VAR intnum iAsk;
  PROC main()
    IDelete iAsk;
    CONNECT iAsk WITH Asked;
    IPers bAsk,iAsk;
    WaitTime 0.4;
    n:=1;
    IDelete iAsk;
    WaitTime 0.4;
    n:=2;
  ENDPROC
  TRAP Asked
    WaitTime 0.05;
    INCR nTraps;
  ENDTRAP
ENDMODULE)",
                    "T", "main");
  const auto ask = [&bench](const char* value) {
    EXPECT_EQ(bench.rws("POST", "/rw/rapid/symbol/data/RAPID/T_ROB1/T/bAsk?action=set", value).status, 204);
  };
  bench.step(25);
  EXPECT_EQ(bench.value("T", "nTraps"), "0");
  ask("value=TRUE");
  bench.step(20);
  EXPECT_EQ(bench.value("T", "nTraps"), "1");
  EXPECT_EQ(bench.value("T", "n"), "0");
  bench.step(70);
  EXPECT_EQ(bench.value("T", "n"), "1") << "the wait that was interrupted ended in its time";
  ask("value=FALSE");
  ASSERT_TRUE(bench.finish(2)) << bench.last_events();
  EXPECT_EQ(bench.value("T", "nTraps"), "1") << "IDelete ended it";
  EXPECT_EQ(bench.value("T", "n"), "2");
}

TEST(RapidProgram, TrapIsNoRoutineToCallOrToPointTo) {
  Bench bench;
  bench.run_program("MODULE T\nPROC main()\n Asked;\nENDPROC\nTRAP Asked\nENDTRAP\nENDMODULE", "T", "main");
  ASSERT_TRUE(bench.finish(1));
  EXPECT_EQ(bench.controller.events().back().type, 3);
  EXPECT_EQ(
      bench.rws("POST", "/rw/rapid/tasks/T_ROB1/pcp?action=set-pp-routine", "module=T&routine=Asked").status,
      400);
}

}  // namespace weldcell::sim
