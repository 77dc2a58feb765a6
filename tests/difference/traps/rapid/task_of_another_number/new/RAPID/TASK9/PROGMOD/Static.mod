MODULE Static
  PROC rIdle0()
    WaitTime 0;
    SetDO doIdle0,1;
    TPWrite "a line of a module that is long enough to tell 0";
  ENDPROC
  PROC rIdle1()
    WaitTime 1;
    SetDO doIdle1,1;
    TPWrite "a line of a module that is long enough to tell 1";
  ENDPROC
  PROC rIdle2()
    WaitTime 2;
    SetDO doIdle2,1;
    TPWrite "a line of a module that is long enough to tell 2";
  ENDPROC
  PROC rIdle3()
    WaitTime 4;
    SetDO doIdle3,1;
    TPWrite "a line of a module that is long enough to tell 3";
  ENDPROC
  PROC rIdle4()
    WaitTime 4;
    SetDO doIdle4,1;
    TPWrite "a line of a module that is long enough to tell 4";
  ENDPROC
  PROC rIdle5()
    WaitTime 5;
    SetDO doIdle5,1;
    TPWrite "a line of a module that is long enough to tell 5";
  ENDPROC
  PROC rIdle6()
    WaitTime 6;
    SetDO doIdle6,1;
    TPWrite "a line of a module that is long enough to tell 6";
  ENDPROC
  PROC rIdle7()
    WaitTime 7;
    SetDO doIdle7,1;
    TPWrite "a line of a module that is long enough to tell 7";
  ENDPROC
  PROC rIdle8()
    WaitTime 8;
    SetDO doIdle8,1;
    TPWrite "a line of a module that is long enough to tell 8";
  ENDPROC
  PROC rIdle9()
    WaitTime 9;
    SetDO doIdle9,1;
    TPWrite "a line of a module that is long enough to tell 9";
  ENDPROC
  PROC rIdle10()
    WaitTime 10;
    SetDO doIdle10,1;
    TPWrite "a line of a module that is long enough to tell 10";
  ENDPROC
  PROC rIdle11()
    WaitTime 11;
    SetDO doIdle11,1;
    TPWrite "a line of a module that is long enough to tell 11";
  ENDPROC
ENDMODULE
